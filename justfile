# Every recipe is one call; what it does is written where it points.

python := if os_family() == "windows" { "python" } else { "python3" }

# List the recipes
default:
    @just --list

# Start the service on a free port, ask it one question, stop it
demo:
    {{python}} dev.py demo

# Every check, then every test; `just test --quick` leaves the slow ones out
test *ARGS:
    {{python}} dev.py test {{ARGS}}

# The checks without pytest
check:
    {{python}} dev.py check

# Let ruff repair and format what it can
fix:
    {{python}} dev.py exec ruff check --fix .
    {{python}} dev.py exec ruff format .

# Run the service until a signal stops it
serve *ARGS:
    {{python}} dev.py serve {{ARGS}}

# What is published: the wheel of every platform and the source distribution, in dist
wheels:
    {{python}} dev.py wheels

# The page as a folder for any static host: it computes in the browser
page:
    {{python}} dev.py page

# Pin the dependencies again; `just lock --upgrade` moves them forward
lock *ARGS:
    {{python}} dev.py lock {{ARGS}}

# Build the image and prove what it promises: unprivileged, read-only, healthy, stops cleanly
container:
    bash deploy/container.sh

# Build a table, e.g. `just build 1e-10`
build TOLERANCE *ARGS:
    {{python}} dev.py exec python -m builder build --tolerance {{TOLERANCE}} --out tables/mumacro-{{TOLERANCE}}.nc {{ARGS}}

# Compare a table with fresh solves of the full model
verify TABLE *ARGS:
    {{python}} dev.py exec python -m builder verify {{TABLE}} {{ARGS}}
