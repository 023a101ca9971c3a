# groundray on Debian 13, built from the distribution's own packages. The archive keeps build trees out:
#   git archive HEAD | docker build -t groundray:debian13 -f .ci/debian13.Dockerfile -
#   docker run --rm -v "$PWD:/work" groundray:debian13 generate scene.yaml -o run
# With --target test it runs all tests instead.
FROM debian:13 AS build
SHELL ["/bin/bash", "-o", "pipefail", "-c"]
WORKDIR /groundray
COPY . .
RUN ./dev build

FROM build AS test
RUN ./dev test

# Programs, their data, and the packages whose libraries they load.
FROM build AS install
RUN cmake --install build/release --strip --prefix /installed \
  && ldd /installed/bin/groundray* | awk '/=> \// {print $3}' | xargs realpath | sort -u | sed 's|.*/|*/|' \
  | xargs dpkg-query -S | grep -v ^diversion | cut -d: -f1 | sort -u > /installed/packages

FROM debian:13
COPY --from=install /installed /usr/local
RUN apt-get update \
  && xargs apt-get install -y --no-install-recommends libgl1-mesa-dri < /usr/local/packages \
  && rm -rf /var/lib/apt/lists/*
WORKDIR /work
ENTRYPOINT ["groundray"]
