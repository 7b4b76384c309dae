# retarget-bench on a CPU, with all weights:
#   docker build -t retarget-bench .
#   docker run --rm -v "$PWD:/work" -u "$(id -u):$(id -g)" retarget-bench run
FROM python:3.12-slim
COPY . /opt/retarget-bench
RUN pip install --no-cache-dir -c /opt/retarget-bench/constraints.txt \
    --extra-index-url https://download.pytorch.org/whl/cpu -e "/opt/retarget-bench[video]"
ENV RETARGET_BENCH_CACHE=/tmp/cache HOME=/tmp
WORKDIR /work
ENTRYPOINT ["bench"]
CMD ["--help"]
