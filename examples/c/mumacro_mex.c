/* Octave and MATLAB: [mu, bound, gradient, regime] = mumacro_mex(mu0, Fz, k, y0, omega, v0)
 *
 * Every input is a number or a matrix; matrices have one size.  mu_macro and its bound are of that
 * size, the gradient has six columns, the regime is 0 (continuous sliding), 1 (stick-slip), 2
 * (static) or -1; illegal cases give NaN.
 * Octave: mkoctfile --mex mumacro_mex.c      MATLAB: mex mumacro_mex.c
 * with mumacro.h beside it, the export in one header. */
#include "mex.h"
#include "mumacro.h"

void mexFunction(int outputs, mxArray *out[], int inputs, const mxArray *in[]) {
    const mxArray *longest = NULL;
    const double *x[6];
    mwSize n, step[6];
    if (inputs != 6 || outputs > 4)
        mexErrMsgIdAndTxt("mumacro:usage",
                          "[mu, bound, gradient, regime] = mumacro_mex(mu0, Fz, k, y0, omega, v0)");
    for (int i = 0; i < 6; ++i) {
        if (!mxIsDouble(in[i]) || mxIsComplex(in[i]) || mxIsSparse(in[i]))
            mexErrMsgIdAndTxt("mumacro:type", "input %d must be a full matrix of real doubles",
                              i + 1);
        if (longest == NULL || mxGetNumberOfElements(longest) == 1) longest = in[i];
    }
    n = mxGetNumberOfElements(longest);
    for (int i = 0; i < 6; ++i) {
        if (mxGetNumberOfElements(in[i]) != 1 &&
            (mxGetM(in[i]) != mxGetM(longest) || mxGetNumberOfElements(in[i]) != n))
            mexErrMsgIdAndTxt("mumacro:size", "input %d has another size than the others", i + 1);
        x[i] = mxGetPr(in[i]);
        step[i] = mxGetNumberOfElements(in[i]) != 1;
    }
    for (int i = 0; i < 4; ++i)
        if (i == 0 || i < outputs)
            out[i] = i == 2
                         ? mxCreateDoubleMatrix(n, 6, mxREAL)
                         : mxCreateNumericArray(mxGetNumberOfDimensions(longest),
                                                mxGetDimensions(longest), mxDOUBLE_CLASS, mxREAL);
    for (mwSize j = 0; j < n; ++j) {
        double c[6];
        mumacro_answer a;
        for (int i = 0; i < 6; ++i) c[i] = x[i][j * step[i]];
        if (outputs < 2) {
            mxGetPr(out[0])[j] = mumacro_mu_macro(c[0], c[1], c[2], c[3], c[4], c[5]);
            continue;
        }
        mumacro_evaluate(c[0], c[1], c[2], c[3], c[4], c[5], &a);
        mxGetPr(out[0])[j] = a.mu_macro;
        mxGetPr(out[1])[j] = a.error_bound;
        for (int i = 0; outputs > 2 && i < 6; ++i)
            mxGetPr(out[2])[j + (mwSize)i * n] = a.gradient[i];
        if (outputs > 3) mxGetPr(out[3])[j] = a.regime;
    }
}
