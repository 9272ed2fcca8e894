"""Measures the CPU time of handing frames from `ffmpeg` to another process: JPEG or pixels, small or large pipe.

`video_pipe.py CLIP [SECONDS]` reads an H.264 clip in real time with the arguments of `lookdown watch`, and prints for each
form the CPU time of `ffmpeg` and of the reader in milliseconds per frame, and the number of reads. Frames are 200 ms
apart. The reader does nothing with them, so that its time is that of system calls and copies.
"""

import fcntl
import os
import resource
import select
import subprocess
import sys
import time

SELECT = "select='isnan(prev_selected_t)+gte(abs(t-prev_selected_t)\\,0.1960)'"
FRAMES_PER_SECOND = 5
JPEG = ("-c:v", "mjpeg", "-q:v", "3", "-pix_fmt", "yuvj420p")
PPM = ("-c:v", "ppm", "-pix_fmt", "rgb24")
LARGE_PIPE = 1 << 20
PAUSE_SECONDS = 0.002
FORMS = {
    "JPEG": (JPEG, None, 0.0),
    "PPM": (PPM, None, 0.0),
    "PPM, pipe of 1 MiB": (PPM, LARGE_PIPE, 0.0),
    "PPM, pipe of 1 MiB, pause": (PPM, LARGE_PIPE, PAUSE_SECONDS),
}


def main(clip: str, seconds: float) -> None:
    """Prints a line for each form."""
    frames = FRAMES_PER_SECOND * seconds
    for name, (encoder, pipe_bytes, pause) in FORMS.items():
        before = cpu_seconds()
        reads = read_all(clip, seconds, encoder, pipe_bytes, pause)
        decoder, reader = (1000 * (now - then) / frames for now, then in zip(cpu_seconds(), before, strict=True))
        print(f"{name}: ffmpeg {decoder:.2f} ms, reader {reader:.2f} ms, {reads / frames:.1f} reads", flush=True)


def read_all(clip: str, seconds: float, encoder: tuple[str, ...], pipe_bytes: int | None, pause: float) -> int:
    """The number of reads until the clip ends."""
    output, given = os.pipe()
    if pipe_bytes:
        fcntl.fcntl(given, fcntl.F_SETPIPE_SZ, pipe_bytes)
    os.set_blocking(output, False)
    source = ["-re", "-threads", "1", "-i", clip, "-t", str(seconds), "-vf", SELECT, "-fps_mode", "passthrough"]
    command = ["ffmpeg", "-nostdin", "-v", "error", *source, "-threads", "1", "-f", "image2pipe", *encoder, "pipe:1"]
    with subprocess.Popen(command, stdout=given):
        os.close(given)
        ready = select.poll()
        ready.register(output, select.POLLIN)
        buffer = memoryview(bytearray(4 << 20))
        reads = 0
        while True:
            ready.poll()
            if os.readv(output, [buffer]) == 0:
                break
            reads += 1
            if pause:
                time.sleep(pause)
    os.close(output)
    return reads


def cpu_seconds() -> tuple[float, float]:
    """The CPU time of the children that have ended, and of this process."""
    usages = (resource.getrusage(who) for who in (resource.RUSAGE_CHILDREN, resource.RUSAGE_SELF))
    first, second = (usage.ru_utime + usage.ru_stime for usage in usages)
    return first, second


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]) if len(sys.argv) > 2 else 20.0)
