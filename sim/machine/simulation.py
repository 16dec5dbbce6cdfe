"""A Verilated bench that is held open from Python."""

__all__ = ["Simulation"]


class Simulation:
    """Ends with its ``with`` block; whoever makes one sets ``_library``, with a ``bench_delete``, and ``_bench``."""

    def close(self):
        """Ends the simulation, and the waveform with it if there is one."""
        if self._bench:
            self._library.bench_delete(self._bench)
            self._bench = None

    def __enter__(self):
        return self

    def __exit__(self, *exception):
        self.close()
