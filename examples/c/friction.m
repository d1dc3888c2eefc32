% A friction law from mumacro.h in Octave or MATLAB, without Python and without a service.
if exist('mumacro_mex', 'file') ~= 3   % compiled once, in this folder
  if exist('OCTAVE_VERSION', 'builtin')
    mkoctfile('--mex', 'mumacro_mex.c')
  else
    mex mumacro_mex.c
  end
end
v0 = logspace(-4, 1, 200);
[mu, bound, gradient, regime] = mumacro_mex(0.3, 10, 1e6, 2e-6, 2*pi*20e3, v0);
[~, steepest] = max(gradient(:, 6)' .* v0);
fprintf('mu_macro from %.15g at %g m/s to %.15g at %g m/s\n', mu(1), v0(1), mu(end), v0(end));
fprintf('bound at most %.2g; continuous sliding from %.4g m/s; steepest near %.3g m/s\n', ...
       max(bound), v0(find(regime == 0, 1)), v0(steepest));
