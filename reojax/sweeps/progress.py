"""Progress of a sweep on stderr: designs done, their rate, the time left."""

from collections.abc import Iterable

from tqdm import tqdm

from reojax._internal.progress import label
from reojax.sweeps.chunks import Chunking


class Progress:
    """A bar that counts designs, chunk by chunk."""

    def __init__(
        self, sizes: Chunking, chunks: Iterable[int], *, show: bool | str, done: Iterable[int] = (), alike: int = 1
    ):
        """Begin to show.

        Args:
            sizes: sizes of the chunks.
            chunks: all chunks to be counted.
            show: whether to show anything, or what to write before the bar.
            done: those that were there before.
            alike: processes that do as much as this one at the same time.
        """
        self._sizes, self._alike = sizes, alike
        total, before = (sum(map(self._designs, numbers)) for numbers in (chunks, done))
        options = {"unit": " designs", "unit_scale": True, "mininterval": 0.5}
        self._bar = tqdm(total=total, initial=before, desc=label(show), disable=not show, **options)

    def add(self, chunk: int) -> None:
        """Count a chunk that is done."""
        self._bar.update(min(self._alike * self._designs(chunk), self._bar.total - self._bar.n))

    def _designs(self, chunk: int) -> int:
        start, stop = self._sizes.bounds(chunk)
        return stop - start

    def __enter__(self) -> "Progress":
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.close()
