% The plain grid of a table in GNU Octave or MATLAB, without a service:
%   python -m builder export tables/mumacro-1e-10.nc --format mat
%   octave-cli examples/octave_mat.m mumacro-1e-10.mat
file = "mumacro-1e-10.mat";
if numel (argv ()) > 0
  file = argv (){1};
end
grid = load (file);
printf ("%d x %d nodes, table of tolerance %g\n", rows (grid.mu_ratio), columns (grid.mu_ratio), grid.info.tolerance);

% mu_ratio has a row a v_tilde and a column a y_tilde, both log-spaced: interpolate in their logarithms
mu0 = 0.3; Fz = 10; k = 1e6; y0 = 2e-6; omega = 1.3e5; v0 = 0.01;
l0 = mu0 * Fz / k;
ratio = interp2 (log (grid.y_tilde), log (grid.v_tilde), grid.mu_ratio, log (y0 / l0), log (v0 / (l0 * omega)), "spline");
printf ("mu_macro = %.6f by interpolation\n", mu0 * ratio);

% The border of continuous sliding at this amplitude
critical = exp (interp1 (log (grid.y_tilde), log (grid.v_tilde_crit), log (y0 / l0), "spline"));
printf ("continuous sliding from v0 = %.6f m/s on\n", critical * l0 * omega);
