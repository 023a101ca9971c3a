"""Notes on what a format cannot express, each printed once, with a count."""

from __future__ import annotations


class Notes:
    """Sentences in the order of their first occurrence."""

    def __init__(self) -> None:
        self._counts: dict[str, int] = {}

    def tell(self, sentence: str) -> None:
        """Adds a sentence once."""
        self._counts.setdefault(sentence, 0)

    def count(self, sentence: str, number: int) -> None:
        """Adds to the number that replaces `{}` in a sentence; ignores 0."""
        if number:
            self._counts[sentence] = self._counts.get(sentence, 0) + int(number)

    def lines(self) -> list[str]:
        """Returns the sentences with their numbers."""
        return [sentence.replace("{}", str(n)) for sentence, n in self._counts.items()]
