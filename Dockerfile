# A walker's server and agents on Debian 12, without windows. docs/install.md says how to build and reach it.
ARG BASE=debian:12-slim

FROM ${BASE} AS build
COPY . /walker_sim
RUN apt-get update -q && apt-get install -q -y --no-install-recommends ca-certificates \
    && /walker_sim/scripts/dev/debian --here

FROM ${BASE}
RUN --mount=type=bind,from=build,source=/walker_sim/build/debian,target=/packages \
    apt-get update -q \
    && apt-get install -q -y --no-install-recommends /packages/*.deb python3-rosservice python3-rostopic \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --create-home walker
USER walker
WORKDIR /home/walker
# Nodes tell each other this address: by default the container's own.
ENTRYPOINT ["/bin/sh", "-c", "export ROS_IP=\"${ROS_IP:-$(hostname -I | cut -d' ' -f1)}\"; exec \"$@\"", "walker_sim"]
# Whether the server answers. Podman and Buildah keep it with --format docker.
HEALTHCHECK --start-period=30s --timeout=15s CMD rosservice call /walker_sim/get_loggers || exit 1
CMD ["roslaunch", "walker_sim", "walker.launch"]
