# retarget-bench on a CPU:
#   docker build -t retarget-bench .
#   docker run --rm -v "$PWD:/work" -u "$(id -u):$(id -g)" retarget-bench run
FROM python:3.12-slim
COPY . /src
RUN pip install --no-cache-dir -c /src/constraints.txt --extra-index-url https://download.pytorch.org/whl/cpu \
    "/src[video]" && rm -r /src
ENV RETARGET_BENCH_CACHE=/tmp/cache HOME=/tmp
WORKDIR /work
ENTRYPOINT ["bench"]
CMD ["--help"]
