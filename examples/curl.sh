#!/bin/sh
# Every kind of question, by curl:  sh examples/curl.sh [ADDRESS]
set -eu
base="${1:-http://127.0.0.1:8000}"
ask() { curl --fail-with-body --silent --show-error "$@"; echo; }

echo "One case, SI units:"
ask "$base/v1/mu-macro?mu0=0.3&Fz=10&k=1e6&y0=2e-6&f=20e3&v0=0.01"

echo "Three loads at once; a plain number holds for every case:"
ask "$base/v1/mu-macro/batch" --json \
    '{"mu0": 0.3, "Fz": [5, 10, 20], "k": 1e6, "y0": 2e-6, "f": 20e3, "v0": 0.01}'

echo "Which amplitude halves the friction?"
ask "$base/v1/solve-for" --json \
    '{"unknown": "y0", "target": 0.15,
      "mu0": 0.3, "Fz": 10, "k": 1e6, "f": 20e3, "v0": 0.01}'

echo "The friction law as a table:"
ask "$base/v1/law.csv?along=v0&start=1e-4&stop=10&points=6&mu0=0.3&Fz=10&k=1e6&y0=2e-6&f=20e3"

echo "Shaken in an ellipse, not only across:"
ask "$base/v1/motion" --json \
    '{"x": [1e-6, 90], "y": 2e-6, "mu0": 0.3, "Fz": 10, "k": 1e6, "f": 20e3, "v0": 0.01}'
