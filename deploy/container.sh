#!/usr/bin/env bash
# Build the image with Docker or podman, run it as in production, and try what the Dockerfile and
# the manifests promise.
#
#   bash deploy/container.sh [-- FLAGS OF BUILD]
#
# For example, in a network with its own certificate authority, with a base image of your own:
#
#   BASE=registry.example/python:3.12 bash deploy/container.sh -- --secret id=ca.pem,src=ca.pem
#
# Exit codes: 0 passed, 1 failed, 77 skipped, because no engine can run here.  Needs bash, curl and
# Python.  All ports are of 127.0.0.1.  The image remains as $IMAGE, its build stage as
# $IMAGE-build.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

IMAGE=${IMAGE:-localhost/mumacro:test}
BASE=${BASE:-docker.io/library/python:3.11-slim}
LARGEST_MB=${LARGEST_MB:-212}   # over the base
WORKER_MB=512                   # the rule of the manifests: memory for each worker
LOAD_S=${LOAD_S:-5}             # of load for one worker and for four; its last answers take longer
CASE='mu0=0.3&Fz=10&k=1e6&y0=2e-6&f=20e3&v0=0.01'
ANSWER=0.24046650645751

read -ra flags <<<"${BUILD_FLAGS:-}"
[[ ${1:-} != -- ]] || { shift; flags+=("$@"); set --; }
(($# == 0)) || { sed -n '5,9s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2; }

work=$(mktemp -d)
container='' pod='' composed=''
# shellcheck disable=SC2317  # called by the trap
clean() {
    [[ -z $container ]] || "$engine" rm --force "$container" >/dev/null 2>&1
    [[ -z $pod ]] || podman play kube --down "$work/kube.yaml" >/dev/null 2>&1
    [[ -z $composed ]] || compose down >/dev/null 2>&1
    rm -rf "$work"
}
trap clean EXIT
fail() { echo "FAILED: $*" >&2; exit 1; }
skip() { echo "skipped: $*" >&2; exit 77; }
passed() { echo "passed: $* (${SECONDS} s)"; }

engine=
for name in docker podman; do
    if "$name" info >/dev/null 2>&1; then engine=$name; break; fi
done
[[ -n $engine ]] || skip "neither docker nor podman runs here"

# --- the build ------------------------------------------------------------------------------------

"$engine" image inspect "$BASE" >/dev/null 2>&1 || "$engine" pull --quiet "$BASE" >/dev/null \
    || fail "the base image $BASE cannot be had"
code=0
"$engine" run --rm "$BASE" python3 -c '' >"$work/log" 2>&1 || code=$?
((code != 125 && code != 126)) || skip "$engine cannot run a container: $(tail -n 1 "$work/log")"
((code == 0)) || fail "the base image $BASE has no python3"

# podman mounts /tmp and /run into a read-only container, Docker does not.
strict=(--read-only --cap-drop=all --security-opt=no-new-privileges --pids-limit=128)
if [[ $engine == podman ]]; then
    flags+=(--format docker)   # the OCI format has no place for HEALTHCHECK
    strict+=(--read-only-tmpfs=false)
fi
# The stages have tags of their own, so that their layers are kept for the next time, once.
build() {  # TAG, then further arguments
    local old
    old=$("$engine" image inspect --format '{{.Id}}' "$1" 2>/dev/null || true)
    "$engine" build "${flags[@]}" --build-arg BASE="$BASE" --tag "$@" . >"$work/log" 2>&1 \
        || { tail -n 20 "$work/log" >&2; fail "the build"; }
    if [[ -n $old && $old != "$("$engine" image inspect --format '{{.Id}}' "$1")" ]]; then
        "$engine" rmi "$old" >/dev/null 2>&1 || true
    fi
}
build "$IMAGE-guide" --target guide
build "$IMAGE-build" --target build
build "$IMAGE"
passed "the build, by $engine on $BASE"

size() { "$engine" image inspect --format '{{.Size}}' "$1"; }
over=$((($(size "$IMAGE") - $(size "$BASE")) / 1000000))
((over <= LARGEST_MB)) || fail "the image has $over MB over its base, more than $LARGEST_MB"
passed "the image has $over MB over its base, at most $LARGEST_MB"

# --- one container --------------------------------------------------------------------------------

start() {  # WORKERS, then further arguments of run
    local workers=$1 memory=$(($1 * WORKER_MB))m
    shift
    container=$("$engine" run --detach "${strict[@]}" --memory="$memory" --memory-swap="$memory" \
        --env MUMACRO_WORKERS="$workers" --publish 127.0.0.1::8000 "$@" "$IMAGE" 2>"$work/log" \
        | tail -n 1)
    [[ -n $container ]] || fail "run: $(tail -n 1 "$work/log")"
    url=http://$("$engine" port "$container" 8000 2>/dev/null | head -n 1)
}
ready() {  # URL
    for _ in $(seq 300); do
        if curl --silent --fail --max-time 5 "$1/readyz" >/dev/null; then return; fi
        sleep 0.1
    done
    [[ -z $container ]] || "$engine" logs "$container" | tail -n 5
    fail "$1 is not ready in 30 s"
}
right() { [[ $(curl --silent --max-time 10 "$1/v1/mu-macro.txt?$CASE") == "$ANSWER"* ]]; }
# the four points of docs/http.md: k = 8.6e6 N/m
POINTS='{"v0": [0.001, 0.005, 0.02, 0.1], "mu_macro": [0.069, 0.174, 0.247, 0.289], "Fz": 10,
    "y0": 4e-7, "f": 20e3}'
fits() {
    curl --silent --fail --max-time 30 --header 'Content-Type: application/json' \
        --data "$POINTS" "$1/v1/fit" | grep -q '"values":{"k":8[0-9]\{6\}\.'
}
inside() { "$engine" exec "$container" python -c "$1" 2>/dev/null; }
end() {  # NAME; stop it, and the exit code must be 0
    local code
    "$engine" stop --time 20 "$container" >/dev/null 2>&1
    code=$("$engine" inspect --format '{{.State.ExitCode}}' "$container" 2>/dev/null)
    [[ $code == 0 ]] || fail "$1: exit code $code after SIGTERM"
    "$engine" rm --force "$container" >/dev/null 2>&1
    container=
}
healthy() {  # the HEALTHCHECK of the image, as the engine runs it
    if [[ $engine == podman ]]; then podman healthcheck run "$container" >/dev/null 2>&1; return; fi
    local told
    for _ in $(seq 90); do
        told=$(docker inspect --format '{{.State.Health.Status}}' "$container")
        [[ $told != healthy ]] || return 0
        sleep 1
    done
    return 1
}

UNWANTED='
import pathlib
sources, others = {".c", ".h", ".cpp", ".hpp", ".a"}, {"pip", "tests", "ziglang"}
found = [str(path) for path in pathlib.Path("/app").rglob("*")
         if (path.suffix in sources or path.name in others)
         and not path.is_relative_to("/app/service/guide")]
print(*found, end="")'
WRITABLE='
import pathlib, tempfile
for place in ("/", "/app", "/tmp", "/run", "/var/tmp"):
    try:
        with tempfile.TemporaryFile(dir=place):
            print(place, end=" ")
    except OSError:
        pass'

for user in 10001:10001 123456:0; do
    start 1 --user "$user"
    ready "$url"
    right "$url" || fail "another answer"
    fits "$url" || fail "no fit"
    curl --silent --fail "$url/guide/validity.html" | grep -q '<h1>' || fail "no guide"
    curl --silent --fail "$url/metrics" | grep -q mumacro_cases_total || fail "no counters"
    runs=$(inside 'import os; print(os.getuid(), os.getgid(), sep=":")')
    [[ $runs == "$user" ]] || fail "user $runs in place of $user"
    writable=$(inside "$WRITABLE")
    [[ -z $writable ]] || fail "can be written: $writable"
    unwanted=$(inside "$UNWANTED")
    [[ -z $unwanted ]] || fail "does not belong in the image: $unwanted"
    healthy || fail "HEALTHCHECK"
    if "$engine" exec --env MUMACRO_PORT=8001 "$container" python -m service healthcheck \
        >/dev/null 2>&1; then
        fail "the health check finds a service where there is none"
    fi
    end "user $user"
    passed "user $user: answer, fit, HEALTHCHECK, read-only, SIGTERM"
done
user=$("$engine" image inspect --format '{{.Config.User}}' "$IMAGE")
[[ $user == 10001:10001 ]] || fail "the image's own user is $user"

# A signal comes while Python still imports.  Then batches are in flight, with answers of 43 MB.
for pause in 0.2 1; do
    start 1
    sleep "$pause"
    end "$pause s after the start"
done
passed "SIGTERM 0.2 and 1 s after the start"
python3 -c 'import json
case = {"mu0": 0.3, "Fz": 10, "k": 1e6, "y0": 2e-6, "f": 20e3}
print(json.dumps({**case, "v0": [1e-3 + 1e-7 * i for i in range(100_000)]}))' >"$work/batch.json"
for workers in 1 4; do
    start "$workers"
    ready "$url"
    sending=()
    for i in 1 2 3; do
        curl --silent --max-time 60 --header 'Content-Type: application/json' \
            --data-binary "@$work/batch.json" \
            --output "$work/answer-$i" --write-out '%{http_code}' \
            "$url/v1/mu-macro/batch?include=gradient,power" >"$work/status-$i" &
        sending+=($!)
    done
    sleep 0.3
    kill -0 "${sending[@]}" 2>/dev/null || fail "no batch was in flight"
    end "batches in flight, $workers workers"
    for i in 1 2 3; do
        wait "${sending[i - 1]}" || fail "a batch in flight was cut, $workers workers"
        [[ $(<"$work/status-$i") == 200 ]] || fail "a batch in flight: status $(<"$work/status-$i")"
        python3 -c 'import json, sys; json.load(sys.stdin)' <"$work/answer-$i" \
            || fail "a batch in flight: half an answer"
    done
    passed "SIGTERM with three batches in flight, workers: $workers: all answered"
done

# --- memory ---------------------------------------------------------------------------------------

# Of the control group, in its version 2 or 1: the most memory, and processes that were killed.
MEMORY='
import pathlib, re
group = pathlib.Path("/sys/fs/cgroup")
def read(*names):
    return next(((group / name).read_text() for name in names if (group / name).exists()), "")
most = read("memory.peak", "memory/memory.max_usage_in_bytes")
killed = re.search(r"oom_kill (\d+)", read("memory.events", "memory/memory.oom_control"))
print(int(most) // 1000000 if most else "unknown", killed[1] if killed else "unknown")'
for workers in 1 4; do
    memory=$((workers * WORKER_MB))
    start "$workers"
    ready "$url"
    load=$(python3 deploy/load.py "$url" --workers "$workers" --seconds "$LOAD_S") \
        || fail "load: $load"
    read -r most killed <<<"$(inside "$MEMORY")"
    [[ $killed != [1-9]* ]] || fail "$workers workers in $memory MiB: $killed processes were killed"
    if "$engine" logs "$container" 2>&1 | grep -q -e 'Child process .* died' -e 'MemoryError'; then
        fail "a worker died"
    fi
    right "$url" || fail "another answer after the load"
    end "after the load"
    echo "$load"
    passed "load, workers: $workers, in $memory MiB: at most $most MB, $killed processes killed"
done

# --- the manifests --------------------------------------------------------------------------------

# Copies with this image.  Another port of 127.0.0.1 for compose, none for Kubernetes: podman would
# publish it on every address.
compose=()
if [[ $engine == docker ]] && docker compose version >/dev/null 2>&1; then
    compose=(docker compose)
elif [[ $engine == podman ]] && command -v podman-compose >/dev/null; then
    compose=(podman-compose)
fi
compose() { "${compose[@]}" --project-name mumacro-test --file "$work/compose.yaml" "$@"; }
if ((${#compose[@]})); then
    port=$(python3 -c 'import socket
with socket.socket() as free:
    free.bind(("127.0.0.1", 0))
    print(free.getsockname()[1])')
    sed "/build: \.\./d; s|image: .*|image: $IMAGE|; s|127.0.0.1:8000:8000|127.0.0.1:$port:8000|" \
        deploy/compose.yaml >"$work/compose.yaml"
    composed=yes
    compose up --detach >"$work/log" 2>&1 || { tail -n 5 "$work/log" >&2; fail "compose up"; }
    ready "http://127.0.0.1:$port"
    right "http://127.0.0.1:$port" || fail "another answer by compose"
    compose down >"$work/log" 2>&1 || { tail -n 5 "$work/log" >&2; fail "compose down"; }
    composed=
    passed "compose.yaml, by ${compose[*]}"
else
    echo "left out: compose.yaml, neither docker compose nor podman-compose is here"
fi

if [[ $engine == podman ]]; then
    sed --expression="s|image: mumacro:.*|image: $IMAGE|" \
        --expression='/- {name: http, containerPort: 8000}/d' \
        --expression='s/^          ports:$/          ports: []/' \
        deploy/kubernetes.yaml >"$work/kube.yaml"
    pod=yes
    podman play kube --network podman "$work/kube.yaml" >"$work/log" 2>&1 \
        || { tail -n 5 "$work/log" >&2; fail "play kube"; }
    played=$(podman ps --quiet --filter name=mumacro-pod-0-mumacro 2>/dev/null)
    address=$(podman inspect --format '{{range .NetworkSettings.Networks}}{{.IPAddress}}{{end}}' \
        "$played" 2>/dev/null)
    ready "http://$address:8000"
    right "http://$address:8000" || fail "another answer by the Deployment"
    podman play kube --down "$work/kube.yaml" >/dev/null 2>&1
    pod=
    passed "the Deployment of kubernetes.yaml, played by podman"
else
    echo "left out: the Deployment of kubernetes.yaml, only podman plays it"
fi
passed "all"
