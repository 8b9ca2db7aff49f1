#!/usr/bin/env bash
# run.sh PROGRAM IMAGE MACHINE: the expectations against an emulated board, or what has to be done first.
set -eu

if [[ ! -x $1 ]]; then
    echo "no $1; run: cmake --preset host-debug && cmake --build --preset host-debug --target port_board" >&2
    exit 1
fi
if ! command -v qemu-system-arm >/dev/null; then
    echo "no qemu-system-arm; run: sudo apt-get install qemu-system-arm" >&2
    exit 1
fi
exec "$@"
