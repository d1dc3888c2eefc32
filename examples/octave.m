% Ask the service from GNU Octave (7 or newer):  octave-cli examples/octave.m [ADDRESS]
base = "http://127.0.0.1:8000";
if numel (argv ()) > 0
  base = argv (){1};
end

% One case, SI units
[text, ok] = urlread ([base "/v1/mu-macro?mu0=0.3&Fz=10&k=1e6&y0=2e-6&f=20e3&v0=0.01"]);
assert (ok);
answer = jsondecode (text);
printf ("mu_macro = %.6f, %s\n", answer.mu_macro, answer.regime);

% A friction law: a table of numbers after one row of names
sweep = "along=v0&start=1e-4&stop=10&points=41";
[text, ok] = urlread ([base "/v1/law.csv?" sweep "&mu0=0.3&Fz=10&k=1e6&y0=2e-6&f=20e3"]);
assert (ok);
columns = textscan (text, "%f %f %f %f %f %s %s", "Delimiter", ",", "HeaderLines", 1);
v0 = columns{1};
mu = columns{2};
printf ("from %.6f at %g m/s to %.6f at %g m/s\n", mu(1), v0(1), mu(end), v0(end));

% How steep is the law at its steepest?
[steepest, i] = max (diff (mu) ./ diff (log10 (v0)));
printf ("steepest near %.2g m/s: %.4f per decade\n", sqrt (v0(i) * v0(i + 1)), steepest);
