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
DEBIAN_BASE=localhost/python:3.11-slim DEBIAN_BUILD_BASE=localhost/python:3.11   # as the official images: the second has binutils
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
    BASE=$DEBIAN_BASE BUILD_BASE=$DEBIAN_BUILD_BASE
    if ! podman image exists "$BASE" || ! podman image exists "$BUILD_BASE"; then
        say "Making $BUILD_BASE and $BASE from Debian's packages"
        # shellcheck disable=SC2016  # apt's own placeholder
        # The mirror that this machine already uses; empty means debootstrap's own default.
        mirror=$(apt-get indextargets --format '$(REPO_URI)' 'Identifier: Packages' "Codename: $SUITE" 2>/dev/null | head -n 1)
        debootstrap --variant=minbase --include=python3,python3-venv,ca-certificates,binutils "$SUITE" "$work/root" \
            ${mirror:+"$mirror"} >"$work/debootstrap.log" 2>&1 </dev/null \
            || { tail -n 5 "$work/debootstrap.log"; skip "debootstrap could not make a base image"; }
        rm -rf "$work"/root/var/cache/apt/archives/*.deb "$work"/root/var/lib/apt/lists/* "$work"/root/usr/share/{doc,man,locale}/*
        tar -C "$work/root" -c . | podman import --quiet - "$BUILD_BASE" >/dev/null
        chroot "$work/root" apt-get purge -y binutils-common libbinutils libctf-nobfd0 libgprofng0 libjansson4 \
            >"$work/purge.log" 2>&1 </dev/null || { tail -n 5 "$work/purge.log"; skip "binutils could not be removed"; }
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
"$engine" build "${build_flags[@]}" ${BASE:+--build-arg "BASE=$BASE"} ${BUILD_BASE:+--build-arg "BUILD_BASE=$BUILD_BASE"} \
    --tag "$IMAGE" \
    --secret "id=pip.conf,src=$work/pip.conf" --secret "id=ca.pem,src=$work/ca.pem" . \
    >"$work/build.log" 2>&1 </dev/null || { tail -n 30 "$work/build.log" >&2; fail "the image does not build"; }
say "Built in $((SECONDS - started)) s"
if [[ -n $replaced && $replaced != "$("$engine" image inspect --format '{{.Id}}' "$IMAGE")" ]]; then
    "$engine" image rm "$replaced" >/dev/null 2>&1 || true   # else every run leaves one image without a name
fi

# --- what the image says of itself ---------------------------------------------------------------------

"$engine" image inspect "$IMAGE" | python3 -c '
import json, sys
config = json.load(sys.stdin)[0]["Config"]
promised = {
    "User": "10001:10001", "ExposedPorts": {"8000/tcp": {}}, "Entrypoint": None, "Cmd": ["python", "-m", "service"],
    "WorkingDir": "/app", "StopSignal": "SIGTERM", "Volumes": None,
}
wrong = {name: config.get(name) for name, value in promised.items() if (config.get(name) or None) != value}
secret = [one for one in config["Env"] if any(word in one.upper() for word in ("PIP_", "PROXY", "KEY", "TOKEN", "PASSWORD"))]
if wrong or secret:
    sys.exit(f"not as promised: {wrong} {secret}")
' || fail "the image says something else of itself than promised"
say "ok  user, port, command, folder, stop signal; no volume, no key in the environment"

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

ask() {  # path, JSON to post or nothing -> body; fails unless the status is 200
    python3 - "$port" "$@" <<'PYTHON'
import http.client, sys

connection = http.client.HTTPConnection("127.0.0.1", int(sys.argv[1]), timeout=60)
if len(sys.argv) > 3:
    connection.request("POST", sys.argv[2], sys.argv[3], {"Content-Type": "application/json"})
else:
    connection.request("GET", sys.argv[2])
reply = connection.getresponse()
print(reply.read().decode())
sys.exit(reply.status != 200)
PYTHON
}

until ask /readyz >/dev/null 2>&1; do
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

case='"mu0": 0.3, "Fz": 10, "k": 1e6, "y0": 2e-6, "omega": 1.3e5'
answer=$(ask /v1/mu-macro "{$case, \"v0\": 0.01}") || fail "the question was answered with: $answer"
# The example of README.md.
python3 -c 'import json, sys; assert abs(json.loads(sys.argv[1])["mu_macro"] - 0.24001) < 1e-5' "$answer" || fail "wrong answer: $answer"
[[ $(ask '/v1/mu-macro?mu0=0.3&Fz=10&k=1e6&y0=2e-6&omega=1.3e5&v0=0.01') == "$answer" ]] || fail "a query is answered otherwise"
say "ok  answers: $answer"
for path in /livez /metrics / /docs; do ask "$path" >/dev/null || fail "$path does not answer"; done
say "ok  /livez, /metrics, both pages"

user=$(inside python -c 'import os; print(os.getuid())')
[[ $user != 0 ]] || fail "it runs as root"
say "ok  runs as user $user"

for folder in / /app /tmp; do
    if inside python -c "open('${folder%/}/probe', 'w')" 2>/dev/null; then fail "it can write to $folder"; fi
done
# By owner and mode, because a read-only root hides them: without one, nothing else may change either.
inside python -c '
import os, stat, sys
uid, gid, wrong = os.getuid(), os.getgid(), []
for top, folders, files in os.walk("/"):
    if top == "/":
        folders[:] = [name for name in folders if name not in ("dev", "proc", "sys")]
    for path in (top, *(os.path.join(top, name) for name in files)):
        status = os.lstat(path)
        mode = status.st_mode
        if stat.S_ISLNK(mode):
            continue
        own = (status.st_uid == uid and mode & 0o200) or (status.st_gid == gid and mode & 0o020)
        shared = mode & 0o002 and not (stat.S_ISDIR(mode) and mode & stat.S_ISVTX)
        # In /app not by the group either: some clusters put every user into group 0.
        if own or shared or (path.startswith("/app") and mode & 0o020):
            wrong.append(f"{path} can be written")
        if path.startswith("/app") and not os.access(path, os.R_OK):
            wrong.append(f"{path} cannot be read")
if wrong:
    sys.exit("\n".join(wrong[:20]))
' || fail "modes of files"
say "ok  nothing can be written but the base's folders for temporary files, everything in /app can be read"

for absent in builder tests pip setuptools; do
    if inside python -c "import $absent" 2>/dev/null; then fail "$absent is in the image's environment"; fi
done
say "ok  no solver, no tests, no pip"

for body in "{$case, \"v0\": [0.01]}" "{$case, \"v0\": [0.01, 0.1, 1.0]}" "[{$case, \"v0\": 0.01}, {$case, \"v0\": 0}]" \
    '{"mu0": [0.3, 0.2], "Fz": [10, 9], "k": [1e6, 2e6], "y0": [2e-6, 0], "omega": [1e5, 2e5], "v0": [0.01, 0.1]}'; do
    answer=$(ask /v1/mu-macro/batch "$body") || fail "a batch was answered with: $answer"
done
every='"include": ["gradient", "power", "stick_fraction", "regime_certain"]'
ask /v1/mu-macro "{$case, \"v0\": 0.01, $every}" >/dev/null || fail "a request with everything included is refused"
ask /v1/law '{"along": "v0", "start": 1e-4, "stop": 10, "points": 201, "mu0": 0.3, "Fz": 10, "k": 1e6, "y0": 2e-6, "omega": 1.3e5}' >/dev/null \
    || fail "a law is refused"
ask /v1/solve-for '{"unknown": "y0", "target": [0.2, 0.15], "mu0": 0.3, "Fz": 10, "k": 1e6, "omega": 1.3e5, "v0": 0.01}' >/dev/null \
    || fail "an inverse problem is refused"
say "ok  every mix of numbers and columns is answered"

memory=$(inside python -c '
import os, pathlib
own = str(os.getpid())
pages = [p.read_text() for p in pathlib.Path("/proc").glob("[0-9]*/status") if p.parent.name != own]
print(sum(int(line.split()[1]) for text in pages for line in text.splitlines() if line.startswith("VmRSS")) // 1024)')
packages=$(inside python -c '
import collections, pathlib, sysconfig
root, sizes = pathlib.Path(sysconfig.get_path("purelib")), collections.Counter()
for path in root.rglob("*"):
    if path.is_file() and not path.is_symlink():
        sizes[path.relative_to(root).parts[0]] += path.stat().st_size / 1e6
print("\n".join(f"{size:7.1f}  {name}" for name, size in sizes.most_common(10)), f"{sizes.total():7.1f}  all", sep="\n")')

"$engine" stop -t 30 "$container" >"$work/stop.log" 2>&1 || { cat "$work/stop.log" >&2; fail "it does not stop"; }
code=$("$engine" inspect --format '{{.State.ExitCode}}' "$container")
[[ $code == 0 ]] || { "$engine" logs --tail 20 "$container" >&2; fail "SIGTERM ended it with exit code $code"; }
say "ok  SIGTERM stops it with exit code 0"

size=$("$engine" image inspect --format '{{.Size}}' "$IMAGE")
base_size=
[[ -n ${BASE:-} ]] && base_size=$("$engine" image inspect --format '{{.Size}}' "$BASE" 2>/dev/null || true)
say "image $((size / 1000000)) MB${base_size:+ (base $((base_size / 1000000)) MB)}, resident memory $memory MB, ready after $ready s"
say "largest packages [MB]:"
say "$packages"
