"""The command `plumbob explain`."""

import sys
from typing import Annotated

from .options import SUCCESS, Text, argument
from .verify import Language


def explain(
    code: Annotated[Text, argument("CODE", "A code that verify prints.")] = None,
    *,
    lang: Language = None,
) -> int:
    """Explain a fault that verify names: cause, remedy, wrong and right lines, symptom.

    Without a code: list all faults.
    """
    from plumbob.crosscheck.verify.language import language_of
    from plumbob.crosscheck.verify.output.fault_text import explained, find_fault, listed
    from plumbob.crosscheck.verify.output.terminal import WIDTH
    from plumbob.crosscheck.verify.output.words import speaker

    say = speaker(lang or language_of())
    width = WIDTH if sys.stdout.isatty() else sys.maxsize
    for line in explained(find_fault(code), say) if code else listed(say, width):
        print(line, flush=True)
    return SUCCESS
