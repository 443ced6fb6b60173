"""The command `plumbob explain`."""

from typing import Annotated

from .options import SUCCESS, Texts, argument
from .verify import Language


def explain(
    words: Annotated[Texts, argument("CODE", "A code that verify prints, or words.")] = None,
    *,
    lang: Language = None,
) -> int:
    """Explain a fault that verify names: cause, remedy, wrong and right lines, symptom.

    Given words, list the faults that contain every word. Without an argument, list the families.
    """
    from plumbob.text.language import language_of
    from plumbob.verify.screen.fault_text import fault_help
    from plumbob.verify.screen.words import speaker

    for line in fault_help(words or (), speaker(language_of(lang))):
        print(line, flush=True)
    return SUCCESS
