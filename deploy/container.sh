#!/usr/bin/env bash
# Build the image, run it as in production (unprivileged, read-only root, no capabilities, little memory), and
# test the properties that the Dockerfile states on the running container.
#
#   bash deploy/container.sh
#
# It uses a Docker engine, else podman.  On Debian as root it needs neither an engine nor an image registry: it
# installs podman from the distribution's packages and makes the base image from them.  Anywhere else it prints
# "skipped: ..." and exits 0.  If a test fails it exits 1.  The image remains as $IMAGE.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

IMAGE=${IMAGE:-localhost/mumacro:test}
SUITE=bookworm                           # Debian 12 carries Python 3.11
DEBIAN_BASE=localhost/python:3.11-slim
READY_S=60

((BASH_VERSINFO[0] >= 5)) || { echo "skipped: bash 5 is needed"; exit 0; }
say() { printf '%s\n' "$*"; }
skip() { say "skipped: $*"; exit 0; }
fail() { say "FAILED: $*" >&2; exit 1; }

work=$(mktemp -d)
container=
clean_up() {
    if [[ -n $container ]]; then "$engine" rm --force "$container" >/dev/null 2>&1 || true; fi
    rm -rf --one-file-system "$work"
}
trap clean_up EXIT

compgen -G 'tables/*.nc' >/dev/null || fail "no table in tables/"
command -v python3 >/dev/null || skip "no python3 to ask the container with"

# --- which engine -------------------------------------------------------------------------------------

build_flags=()
network_flags=(--publish 127.0.0.1::8000)
runtime_flags=()
strict_flags=()
if docker info >/dev/null 2>&1; then
    engine=docker
elif command -v podman >/dev/null && [[ $(id -u) != 0 ]]; then
    engine=podman
    build_flags=(--format docker)        # the OCI format has no place for HEALTHCHECK
else
    engine=podman
    [[ $(id -u) == 0 ]] || skip "no Docker engine, no podman, and not root to install one"
    missing=()
    for tool in podman runc conmon debootstrap; do command -v "$tool" >/dev/null || missing+=("$tool"); done
    if ((${#missing[@]})); then
        command -v apt-get >/dev/null || skip "no Docker engine, and without apt-get no way to install ${missing[*]}"
        say "Installing ${missing[*]}"
        { apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends "${missing[@]}"; } \
            >"$work/apt.log" 2>&1 </dev/null || { tail -n 5 "$work/apt.log"; skip "could not install ${missing[*]}"; }
    fi
    # Works inside another container or virtual machine too: no user namespace, no bridge, no systemd.
    build_flags=(--format docker --isolation chroot --network host)
    network_flags=(--network host)
    runtime_flags=(--runtime runc --cgroup-manager cgroupfs)
fi
if [[ $engine == podman ]]; then
    podman info >/dev/null 2>&1 || skip "podman does not work here: $(podman info 2>&1 | tail -n 1)"
    strict_flags=(--read-only-tmpfs=false)   # podman would put writable folders over /tmp and /run
fi
say "Engine: $("$engine" --version)"

# --- base image ---------------------------------------------------------------------------------------

if [[ -z ${BASE:-} && ${#runtime_flags[@]} -gt 0 ]]; then
    BASE=$DEBIAN_BASE
    if ! podman image exists "$BASE"; then
        say "Making $BASE from Debian's packages"
        # shellcheck disable=SC2016  # apt's own placeholder
        # The mirror that this machine already uses; empty means debootstrap's own default.
        mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Identifier: Packages' "Codename: $SUITE" 2>/dev/null | head -n 1)
        debootstrap --variant=minbase --include=python3,python3-venv,ca-certificates "$SUITE" "$work/root" \
            ${mirror:+"$mirror"} >"$work/debootstrap.log" 2>&1 </dev/null \
            || { tail -n 5 "$work/debootstrap.log"; skip "debootstrap could not make a base image"; }
        rm -rf "$work"/root/var/cache/apt/archives/*.deb "$work"/root/var/lib/apt/lists/* "$work"/root/usr/share/{doc,man,locale}/*
        tar -C "$work/root" -c . | podman import --quiet - "$BASE" >/dev/null
    fi
fi

# --- build --------------------------------------------------------------------------------------------

# The network settings of this machine's pip, as build secrets.  Local folders are left out: the build has no
# access to them.
: >"$work/pip.conf"; : >"$work/ca.pem"; chmod 600 "$work/pip.conf"
python3 - "$work" <<'PYTHON'
import ast, os, pathlib, shutil, subprocess, sys

work = pathlib.Path(sys.argv[1])
listed = subprocess.run([sys.executable, "-m", "pip", "config", "list"], capture_output=True, text=True).stdout
values = {}
for line in listed.splitlines():
    name, _, value = line.partition("=")
    section, _, key = name.rpartition(".")
    if section in ("global", "install", ":env:"):
        values[key] = str(ast.literal_eval(value))
for key in ("index-url", "extra-index-url", "trusted-host", "proxy", "timeout", "cert"):
    if given := os.environ.get("PIP_" + key.upper().replace("-", "_")):
        values[key] = given
lines = ["[global]"]
for key in ("index-url", "extra-index-url"):
    words = [word for word in values.get(key, "").split() if word.startswith(("http://", "https://"))]
    lines += [f"{key} = {' '.join(words)}"] if words else []
lines += [f"{key} = {' '.join(values[key].split())}" for key in ("trusted-host", "proxy", "timeout") if values.get(key)]
names = ("SSL_CERT_FILE", "REQUESTS_CA_BUNDLE", "CURL_CA_BUNDLE")
for bundle in (values.get("cert"), *(os.environ.get(name) for name in names)):
    if bundle and os.path.isfile(bundle):
        shutil.copyfile(bundle, work / "ca.pem")
        lines.append("cert = /etc/pip-ca.pem")
        break
(work / "pip.conf").write_text("\n".join(lines) + "\n")
PYTHON

say "Building $IMAGE"
started=$SECONDS
replaced=$("$engine" image inspect --format '{{.Id}}' "$IMAGE" 2>/dev/null || true)
"$engine" build "${build_flags[@]}" ${BASE:+--build-arg "BASE=$BASE"} --tag "$IMAGE" \
    --secret "id=pip.conf,src=$work/pip.conf" --secret "id=ca.pem,src=$work/ca.pem" . \
    >"$work/build.log" 2>&1 </dev/null || { tail -n 30 "$work/build.log" >&2; fail "the image does not build"; }
say "Built in $((SECONDS - started)) s"
if [[ -n $replaced && $replaced != "$("$engine" image inspect --format '{{.Id}}' "$IMAGE")" ]]; then
    "$engine" image rm "$replaced" >/dev/null 2>&1 || true   # else every run leaves one image without a name
fi

# --- run ----------------------------------------------------------------------------------------------

if [[ ${network_flags[*]} == "--network host" ]]; then
    port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
    network_flags+=(--env MUMACRO_HOST=127.0.0.1 --env "MUMACRO_PORT=$port")   # host network: loopback only
fi

# A kernel may refuse limits (no cgroup controller, no right to raise one).  Those flags are dropped one by one,
# with a message; the flags that are tested (user, read-only root, no capabilities) are never dropped.
limits=(--memory=300m --ulimit=nofile=4096:4096 --ulimit=nproc=8192:8192)
while :; do
    if container=$("$engine" "${runtime_flags[@]}" run --detach "${network_flags[@]}" --read-only \
            "${strict_flags[@]}" --cap-drop=all --security-opt=no-new-privileges "${limits[@]}" "$IMAGE" 2>"$work/run.log" </dev/null); then
        break
    fi
    container=$(tail -n 1 <<<"$container")
    if [[ -n $container ]]; then "$engine" rm --force "$container" >/dev/null 2>&1 || true; container=; fi
    ((${#limits[@]})) || { cat "$work/run.log" >&2; fail "the container does not start"; }
    say "Dropped ${limits[-1]}, refused here: $(tail -n 1 "$work/run.log")"
    unset 'limits[-1]'
done
born=$(date +%s.%N)
inside() { "$engine" exec "$container" "$@"; }
port=${port:-$("$engine" port "$container" 8000/tcp | head -n 1 | sed 's/.*://')}

get() {  # path -> body; fails unless the status is 200
    python3 - "$port" "$1" <<'PYTHON'
import http.client, sys

connection = http.client.HTTPConnection("127.0.0.1", int(sys.argv[1]), timeout=10)
connection.request("GET", sys.argv[2])
reply = connection.getresponse()
print(reply.read().decode())
sys.exit(reply.status != 200)
PYTHON
}

until get /readyz >/dev/null 2>&1; do
    [[ $("$engine" inspect --format '{{.State.Running}}' "$container") == true ]] \
        || { "$engine" logs "$container" >&2; fail "the service ended by itself"; }
    (($(date +%s) - ${born%.*} < READY_S)) || { "$engine" logs "$container" >&2; fail "not ready after $READY_S s"; }
    sleep 0.05
done
ready=$(python3 -c "import time; print(f'{time.time() - $born:.1f}')")

# --- tests --------------------------------------------------------------------------------------------

if [[ $engine == podman ]]; then podman healthcheck run "$container" >/dev/null; else inside python -m service healthcheck >/dev/null; fi \
    || fail "the health check fails"
say "ok  health check"

answer=$(get '/v1/mu-macro?mu0=0.3&Fz=10&k=1e6&y0=2e-6&omega=1.3e5&v0=0.01') || fail "the query was answered with: $answer"
python3 -c 'import json, sys; assert 0 <= json.loads(sys.argv[1])["mu_macro"] <= 0.3' "$answer" || fail "wrong answer: $answer"
say "ok  answers: $answer"

user=$(inside python -c 'import os; print(os.getuid())')
[[ $user != 0 ]] || fail "it runs as root"
say "ok  runs as user $user"

for folder in / /app /tmp; do
    if inside python -c "open('${folder%/}/probe', 'w')" 2>/dev/null; then fail "it can write to $folder"; fi
done
say "ok  cannot write to /, /app, /tmp"

if inside python -c 'import builder' 2>/dev/null; then fail "the solver is in the image"; fi
if inside python -c 'import pip' 2>/dev/null; then fail "pip is in the image's environment"; fi
say "ok  no solver, no pip"

# Every kernel must come from the image, for every mix of numbers and columns in a request.
batch() {  # JSON -> fails unless the status is 200
    python3 - "$port" "$1" <<'PYTHON'
import http.client, sys

connection = http.client.HTTPConnection("127.0.0.1", int(sys.argv[1]), timeout=60)
connection.request("POST", "/v1/mu-macro/batch", sys.argv[2], {"Content-Type": "application/json"})
reply = connection.getresponse()
body = reply.read().decode()
if reply.status != 200:
    sys.exit(body)
PYTHON
}
case='"mu0": 0.3, "Fz": 10, "k": 1e6, "y0": 2e-6, "omega": 1.3e5'
batch "{$case, \"v0\": [0.01]}" && batch "{$case, \"v0\": [0.01, 0.1, 1.0]}" && batch "[{$case, \"v0\": 0.01}, {$case, \"v0\": 0}]" \
    && batch '{"mu0": [0.3, 0.2], "Fz": [10, 9], "k": [1e6, 2e6], "y0": [2e-6, 0], "omega": [1e5, 2e5], "v0": [0.01, 0.1]}' \
    || fail "a batch was refused"
loads=$("$engine" exec --env NUMBA_DEBUG_CACHE=1 "$container" python -m service warm --tables tables 2>&1)
if late=$({ "$engine" logs "$container" 2>&1; echo "$loads"; } | grep 'compiled while serving'); then
    fail "not every kernel is in the image: $late"
fi
loaded=$(grep -c 'data loaded' <<<"$loads") || fail "no kernel was loaded from the image's cache"
say "ok  $loaded kernels loaded from the image, none compiled while serving"

memory=$(inside python -c '
import os, pathlib
own = str(os.getpid())
pages = [p.read_text() for p in pathlib.Path("/proc").glob("[0-9]*/status") if p.parent.name != own]
print(sum(int(line.split()[1]) for text in pages for line in text.splitlines() if line.startswith("VmRSS")) // 1024)')

"$engine" stop -t 30 "$container" >"$work/stop.log" 2>&1 || { cat "$work/stop.log" >&2; fail "it does not stop"; }
code=$("$engine" inspect --format '{{.State.ExitCode}}' "$container")
[[ $code == 0 ]] || { "$engine" logs --tail 20 "$container" >&2; fail "SIGTERM ended it with exit code $code"; }
say "ok  SIGTERM stops it with exit code 0"

size=$("$engine" image inspect --format '{{.Size}}' "$IMAGE")
base_size=
[[ -n ${BASE:-} ]] && base_size=$("$engine" image inspect --format '{{.Size}}' "$BASE" 2>/dev/null || true)
say "image $((size / 1000000)) MB${base_size:+ (base $((base_size / 1000000)) MB)}, resident memory $memory MB, ready after $ready s"
