ARG BASE_IMAGE=debian:bookworm-slim

# Builds the wheel in its released form: with the C library, the studio page and the documentation pages.
FROM ${BASE_IMAGE} AS wheel
# For another package index than PyPI: --build-arg PIP_INDEX_URL=…
ARG PIP_INDEX_URL
RUN apt-get update \
    && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends \
        ca-certificates gcc libc6-dev python3-venv
COPY . /tmp/joulepath
RUN python3 -m venv /tmp/pip \
    && /tmp/pip/bin/pip wheel --no-cache-dir --disable-pip-version-check --no-deps --wheel-dir /tmp /tmp/joulepath

# Installs the locked dependencies and the wheel, removes files for builds, and compiles the kernels.
FROM ${BASE_IMAGE} AS build
ARG PIP_INDEX_URL
RUN apt-get update \
    && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends \
        binutils ca-certificates gcc libc6-dev libgomp1 python3-venv
WORKDIR /opt/joulepath
ENV PATH=/opt/joulepath/venv/bin:$PATH
# requirements-cluster.lock also has the packages for JOULEPATH_CLUSTER
ARG LOCK=requirements.lock
COPY ${LOCK} scripts/slim.py /tmp/
RUN python3 -m venv venv \
    && pip install --no-cache-dir --no-compile --disable-pip-version-check --require-hashes --no-deps \
        -r /tmp/${LOCK} \
    && python /tmp/slim.py venv
COPY --from=wheel /tmp/*.whl /tmp/
# Importing every module proves that no needed file was removed, and writes the bytecode.
COPY scripts/import_all.py /tmp/
ENV JOULEPATH_CACHE_DIR=/opt/joulepath/kernels MPLCONFIGDIR=/opt/matplotlib
RUN mkdir /opt/matplotlib \
    && pip install --no-compile --disable-pip-version-check --no-deps --no-index /tmp/*.whl \
    && pip uninstall --yes --quiet pip setuptools \
    && python /tmp/import_all.py \
    && python -m joulepath.optimizer.dynamics.precompile --portable

FROM ${BASE_IMAGE}
RUN apt-get update \
    && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends libgomp1 python3 \
    && rm -rf /var/lib/apt/lists/* /var/cache/apt/* /var/log/* \
    && useradd --system --uid 10001 --home-dir /opt/joulepath --no-create-home joulepath \
    && install --directory --owner=joulepath /var/lib/joulepath
WORKDIR /opt/joulepath
COPY --from=build /opt/joulepath .
# toppra imports matplotlib, which needs a writable folder for its cache
COPY --from=build --chown=joulepath /opt/matplotlib /opt/matplotlib
# JOULEPATH_OPEN: the network of the container decides which clients reach the service
ENV PATH=/opt/joulepath/venv/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    PYTHONDONTWRITEBYTECODE=1 \
    JOULEPATH_CACHE_DIR=/opt/joulepath/kernels \
    MPLCONFIGDIR=/opt/matplotlib \
    JOULEPATH_DATABASE_URL=sqlite:////var/lib/joulepath/joulepath.db \
    JOULEPATH_HOST=0.0.0.0 \
    JOULEPATH_OPEN=1 \
    PORT=8000
# a number, so that an orchestrator can verify that the user is not root
USER 10001
# studies survive the container if a volume is mounted here
VOLUME /var/lib/joulepath
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=3s --start-period=30s --retries=3 \
    CMD ["python", "-c", "import os, urllib.request; urllib.request.urlopen(f'http://127.0.0.1:{os.environ[\"PORT\"]}/healthz', timeout=2)"]
CMD ["python", "-m", "joulepath.app"]
