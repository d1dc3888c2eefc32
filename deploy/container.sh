#!/usr/bin/env bash
# Build the image with Docker or podman, run it as in production, and try what the Dockerfile promises.
#
#   bash deploy/container.sh
#
# Without an engine it says so and exits 0; if a test fails it exits 1.  The image remains as $IMAGE.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

IMAGE=${IMAGE:-localhost/mumacro:test}
LARGEST_MB=${LARGEST_MB:-370}
fail() { echo "FAILED: $*" >&2; exit 1; }

engine=
for name in docker podman; do
    if "$name" info >/dev/null 2>&1; then engine=$name; break; fi
done
[[ -n $engine ]] || { echo "skipped: neither docker nor podman runs here"; exit 0; }

flags=()
[[ $engine == podman ]] && flags=(--format docker)   # the OCI format has no place for HEALTHCHECK
"$engine" build "${flags[@]}" --tag "$IMAGE" .

container=$("$engine" run --detach --read-only --cap-drop=all --security-opt=no-new-privileges --memory=768m \
    --pids-limit=128 --publish 127.0.0.1::8000 "$IMAGE")
trap '"$engine" rm --force "$container" >/dev/null' EXIT
url=http://$("$engine" port "$container" 8000 | head -n 1)

ready=
for _ in $(seq 60); do
    if curl --silent --fail "$url/readyz" >/dev/null; then ready=yes; break; fi
    sleep 0.5
done
[[ -n $ready ]] || { "$engine" logs "$container"; fail "not ready in 30 s"; }

case='mu0=0.3&Fz=10&k=1e6&y0=2e-6&omega=1.3e5&v0=0.01'
[[ $(curl --silent "$url/v1/mu-macro.txt?$case") == 0.24001211754819* ]] || fail "another answer"
curl --silent --fail "$url/metrics" | grep -q mumacro_cases_total || fail "no counters"
"$engine" exec "$container" python -m service healthcheck || fail "the health check"
[[ $("$engine" exec "$container" python -c 'import os; print(os.getuid())') == 10001 ]] || fail "it runs as another user"
if "$engine" exec "$container" python -c 'open("/app/x", "w")' 2>/dev/null; then fail "the root can be written"; fi
size=$(($("$engine" image inspect --format '{{.Size}}' "$IMAGE") / 1000000))
((size <= LARGEST_MB)) || fail "the image has $size MB, more than $LARGEST_MB"

"$engine" stop --time 20 "$container" >/dev/null
code=$("$engine" inspect --format '{{.State.ExitCode}}' "$container")
[[ $code == 0 ]] || fail "exit code $code after SIGTERM"
echo "passed: $size MB"
