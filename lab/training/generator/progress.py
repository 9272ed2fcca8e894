"""A progress line with the time left, printed and appended to a log."""

import time


class Progress:
    def __init__(self, name, total, log=None):
        self.name, self.total, self.done, self.start, self.cpu, self.log = (
            name,
            total,
            0,
            time.time(),
            time.process_time(),
            log,
        )
        if log is not None:
            log.parent.mkdir(parents=True, exist_ok=True)
        self._write(f"{name}: {total} to make")

    def step(self):
        self.done += 1
        each = (time.time() - self.start) / self.done
        cpu = (time.process_time() - self.cpu) / self.done
        left = each * (self.total - self.done) / 60
        self._write(
            f"{self.name}: {self.done}/{self.total}, {each:.1f} s each ({cpu:.1f} s of CPU), {left:.0f} min left"
        )

    def _write(self, line):
        print(line, flush=True)
        if self.log is not None:
            with open(self.log, "a") as out:
                out.write(f"{time.strftime('%H:%M:%S')} {line}\n")
