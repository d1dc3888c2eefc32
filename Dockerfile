# The service and the packages that it needs: no solver, no tests, no compiler, no pip.  The build
# stage compiles the kernel with its own compiler, or with zig, which runs on every image.
#
#   docker build -t mumacro .
#   docker run --read-only --cap-drop=all -p 127.0.0.1:8000:8000 mumacro
#
# These two are not run by the checks as they stand: deploy/container.sh does the same by docker or
# podman, under names and a port of its own.
#
# BASE may be any image with a `python3` of 3.11 or newer.  BUILD_BASE, if it is another image, must
# have the same Python at the same path and the same C library: the environment made in it has the
# path of its interpreter. BUILD_BASE must be able to make a virtual environment; BASE needs neither
# that nor a shell.
ARG BASE=python:3.11-slim
ARG BUILD_BASE=${BASE}

# The guide that the page links to.
FROM ${BUILD_BASE} AS guide
WORKDIR /project
RUN python3 -m venv /venv
COPY requirements/docs.txt /venv/
RUN --mount=type=secret,id=pip.conf,target=/etc/pip.conf \
    --mount=type=secret,id=ca.pem,target=/etc/pip-ca.pem \
    /venv/bin/python -m pip install --no-cache-dir --disable-pip-version-check --require-hashes \
        -r /venv/docs.txt
COPY . .
RUN /venv/bin/sphinx-build -W -q -d /doctrees docs /guide && chmod -R a+rX,go-w /guide

FROM ${BUILD_BASE} AS build
WORKDIR /app
# A virtual environment, because a distribution's own Python may refuse installs (PEP 668), and
# because it is copied to the next stage as one folder.
RUN python3 -m venv venv && python3 -m venv /build/venv
COPY requirements/service.txt requirements/build.txt requirements/zig.txt /build/
# A network with its own certificate authority or package index passes them as the two secrets.
# They are optional, and neither is stored in a layer.
RUN --mount=type=secret,id=pip.conf,target=/etc/pip.conf \
    --mount=type=secret,id=ca.pem,target=/etc/pip-ca.pem \
    install="-m pip install --no-cache-dir --disable-pip-version-check --require-hashes" \
    && venv/bin/python $install -r /build/service.txt \
    && /build/venv/bin/python $install -r /build/build.txt -r /build/zig.txt
# The tests of other projects are a tenth of the environment.
RUN find venv -type d \( -name tests -o -name test \) -path '*/site-packages/*' \
        -prune -exec rm -rf {} + \
# Sources and headers for compilers, and stubs for type checkers.
    && find venv -type f \( -name '*.[ach]' -o -name '*.cpp' -o -name '*.hpp' \
        -o -name '*.p[xy][xdi]' \) -delete \
# Of scipy what a fit needs: optimize and special, and what these import.
    && cd venv/lib/python3*/site-packages/scipy \
    && rm -rf cluster datasets differentiate fftpack integrate interpolate io misc ndimage odr \
        signal stats \
    && cd /app \
# Symbols for debuggers, where the build image has binutils.  Not of *.libs, which were edited after
# linking.
    && if command -v strip >/dev/null; then \
        find venv -name '*.so' -not -path '*.libs/*' -exec strip --strip-unneeded {} +; fi \
# pip has no business in a running image.
    && venv/bin/python -m pip uninstall --quiet --yes pip setuptools
COPY LICENSE ./
COPY src src
COPY service service
COPY tables tables
COPY hatch_build.py pyproject.toml /build/
COPY src/mumacro/kernel /build/src/mumacro/kernel
# The kernel holds code for several processors and chooses when it is loaded: the image also runs on
# other machines than the one that built it.  Its sources stay in this stage.  Every user of the
# container may read all files, whatever the umask of the checkout; no user may write them.
RUN /build/venv/bin/python /build/hatch_build.py src/mumacro \
    && rm src/mumacro/kernel/*.[ch] \
    && venv/bin/python -m compileall -q src service \
    && chmod -R a+rX,go-w .

FROM ${BASE}
LABEL org.opencontainers.image.title="mumacro" \
      org.opencontainers.image.description="Friction under oscillation: REST service" \
      org.opencontainers.image.licenses="Apache-2.0" \
      org.opencontainers.image.version="0.1.0" \
      org.opencontainers.image.vendor="The mumacro developers"
COPY --from=build /app /app
COPY --from=guide /guide /app/service/guide
WORKDIR /app
ENV PATH=/app/venv/bin:$PATH \
    PYTHONPATH=/app/src:/app \
    PYTHONUNBUFFERED=1 \
    PYTHONDONTWRITEBYTECODE=1 \
    HOME=/nonexistent \
    MUMACRO_HOST=0.0.0.0
# A number, not a name: Kubernetes can then check runAsNonRoot, and no entry in /etc/passwd is
# needed.
USER 10001:10001
EXPOSE 8000
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=30s --timeout=15s --start-period=30s --retries=3 \
    CMD ["python", "-m", "service", "healthcheck"]
CMD ["python", "-m", "service"]
