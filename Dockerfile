ARG BASE_IMAGE=debian:bookworm-slim

# Installs the locked dependencies, leaves behind what only builds need, compiles the C library and the kernels.
FROM ${BASE_IMAGE} AS build
# A package index other than PyPI: --build-arg PIP_INDEX_URL=…
ARG PIP_INDEX_URL
RUN apt-get update \
    && DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends \
        binutils ca-certificates gcc libc6-dev libgomp1 python3-venv
WORKDIR /opt/joulepath
ENV PATH=/opt/joulepath/venv/bin:$PATH
# requirements-cluster.lock has what JOULEPATH_CLUSTER needs, too
ARG LOCK=requirements.lock
COPY ${LOCK} scripts/slim.py /tmp/
RUN python3 -m venv venv \
    && pip install --no-cache-dir --no-compile --disable-pip-version-check --require-hashes --no-deps \
        -r /tmp/${LOCK} \
    && pip uninstall --yes --quiet pip setuptools \
    && python /tmp/slim.py venv
# The studio page, by a Node that stays in this step.
COPY requirements-node.lock scripts/build_studio.py /tmp/studio/scripts/
COPY app/studio /tmp/studio/joulepath/app/studio
COPY examples/optimize/bin_to_shelf.json /tmp/studio/examples/optimize/
RUN mv /tmp/studio/scripts/requirements-node.lock /tmp/studio/ \
    && python3 -m venv /tmp/node && PATH=/tmp/node/bin:$PATH \
    && python /tmp/studio/scripts/build_studio.py \
    && rm -rf /tmp/node /tmp/studio/joulepath/app/studio
COPY LICENSE ./
COPY joulepath joulepath
COPY models models
COPY optimizer optimizer
COPY app app
RUN rm -rf app/studio app/static/studio
COPY examples app/static/examples
RUN mv /tmp/studio/joulepath/app/static/studio app/static/
ENV JOULEPATH_CACHE_DIR=/opt/joulepath/kernels MPLCONFIGDIR=/opt/matplotlib
# Importing every module shows that nothing needed was left behind, and leaves the bytecode of what is used.
COPY scripts/import_all.py /tmp/
RUN mkdir /opt/matplotlib \
    && python optimizer/native/build.py \
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
# matplotlib, which toppra imports, keeps its cache only where it may write
COPY --from=build --chown=joulepath /opt/matplotlib /opt/matplotlib
# open: who reaches it is decided by the network of the container
ENV PATH=/opt/joulepath/venv/bin:$PATH \
    PYTHONUNBUFFERED=1 \
    PYTHONDONTWRITEBYTECODE=1 \
    JOULEPATH_CACHE_DIR=/opt/joulepath/kernels \
    MPLCONFIGDIR=/opt/matplotlib \
    JOULEPATH_DATABASE_URL=sqlite:////var/lib/joulepath/joulepath.db \
    JOULEPATH_HOST=0.0.0.0 \
    JOULEPATH_OPEN=1 \
    PORT=8000
# by number, so that an orchestrator can tell that it is not root
USER 10001
# studies outlast the container where a volume is mounted here
VOLUME /var/lib/joulepath
EXPOSE 8000
HEALTHCHECK --interval=10s --timeout=3s --start-period=30s --retries=3 \
    CMD ["python", "-c", "import os, urllib.request; urllib.request.urlopen(f'http://127.0.0.1:{os.environ[\"PORT\"]}/healthz', timeout=2)"]
CMD ["python", "-m", "joulepath.app"]
