"""Refusals: dangerous products, by name and by structure, and reagents that must not be part of one experiment."""

from __future__ import annotations

import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import Any, ClassVar

from labgym.artefacts import artefacts
from labgym.assets.inference.prohibited import ProhibitedSubstanceError, refuse_weapon
from labgym.assets.inference.substructures import matches
from labgym.assets.structures import StructureError, canonical, standard
from labgym.documents import Document, Record
from labgym.errors import MissingDependencyError
from labgym.protocols.errors import RefusalError

LEAST_AZIDE_CARBONS = 4
"""Least number of carbon atoms of an alkyl azide that may be made, cold and undistilled."""
DINITRO_BALANCE_PERCENT = -90.0
"""Oxygen balance below which a dinitro compound is no explosive: dinitrophenol has -78, dinitrobenzene -95, TNT -74."""
_ENERGETIC = (
    "[NX2]=[N+]=[N-]",
    "[N+]#N",
    "[NX3][N+](=O)[O-]",
    "O[N+](=O)[O-]",
    "[OX2][OX2]",
    "n1nnnc1",
    "[OX1-,OX2H]c",
)
_CONFUSABLE = str.maketrans(
    "аеорсхуіјѕԁһҺАВСЕНІЈКМОРЅТХУАαοινρτυκΑΒΕΖΗΙΚΜΝΟΡΤΥΧ",
    "aeopcxyijsdhhABCEHIJKMOPSTXYAaoinptukABEZHIKMNOPTYX",
)
"""Cyrillic and Greek letters that look like Latin ones."""
_ACRONYM = re.compile(r"\b(?:[A-Za-z]\.){2,6}[A-Za-z]?(?![A-Za-z])")
_FORMULA = re.compile(
    r"\b(?i:make|making|prepare|preparing|produce|producing|synthesi[sz]e|synthesi[sz]ing|preparation of|synthesis of|"
    r"to give|into|generate|generating)\s+([A-Z][A-Za-z0-9()]{1,30})(?![A-Za-z0-9])"
)
_WORDS = re.compile(r"[a-z0-9@$][a-z0-9@$'’_-]*+")
_DIGITS = str.maketrans("01345@$", "oieasas")
SHORTEST_NAME, LONGEST_NAME = 9, 40
"""Lengths of names that are recognized although misspelled."""
_TOKEN = re.compile(r"[^\s,;]{2,300}")
_SMILES = re.compile(
    r"(?=[^=#\[(]*+[=#\[(])(?:[BCNOPSFIHbcnops\d=#@+\\/()\[\].%-]|Cl|Br|Si|Hg|Ag|Pb|Ni|As|Os|Se|Na|Li)++"
)
"""A word that may be a SMILES with a double bond, a branch or a bracket."""
MAX_STRUCTURES = 20
"""Most SMILES of a text that are judged."""


class Wish(Record):
    """A kind of product that is refused, with the words that name it.

    Attributes:
        english: pattern of the words.
        followed_by: pattern of words of which one must come later in the text for those of `english` to count.
        names: long names that count however they are spaced or hyphenated, with digits for letters, or misspelled.
        formulas: formulas that count after a verb of making.
    """

    what: str
    english: str
    followed_by: str = ""
    chinese: tuple[str, ...]
    names: tuple[str, ...] = ()
    formulas: tuple[str, ...] = ()


class HazardousProduct(Record):
    """A kind of substance that no protocol makes, with the grammar of its names and its structures.

    Attributes:
        english: pattern of names in lower case. chinese: parts of names.
        why: what it does.
        smarts: patterns, any of which must match. several: patterns that must match at least twice.
        small: patterns that count in a molecule with fewer than `LEAST_AZIDE_CARBONS` carbon atoms.
        without: patterns none of which may match. smiles: single substances of the kind.
    """

    what: str
    english: str
    chinese: tuple[str, ...]
    why: str
    smarts: tuple[str, ...] = ()
    several: tuple[str, ...] = ()
    small: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    smiles: tuple[str, ...] = ()

    def includes(self, structure: Any, spelling: str) -> bool:
        """Return whether a structure is of this kind.

        Args:
            structure: RDKit molecule of the canonical form.
            spelling: its canonical SMILES.
        """
        if any(matches(structure, smarts) for smarts in self.without):
            return False
        carbons = sum(atom.GetSymbol() == "C" for atom in structure.GetAtoms())
        return (
            any(matches(structure, smarts) for smarts in self.smarts)
            or any(len(matches(structure, smarts)) > 1 for smarts in self.several)
            or (carbons < LEAST_AZIDE_CARBONS and any(matches(structure, smarts) for smarts in self.small))
            or any(canonical(smiles) == spelling for smiles in self.smiles)
        )


class Making(Record):
    """Kinds of substances that together make what must not be made, whatever the product is called.

    Attributes:
        what: they make.
        a, b, c: patterns of the structures; one of each set must be present. `c` may be empty.
    """

    what: str
    a: tuple[str, ...]
    b: tuple[str, ...]
    c: tuple[str, ...] = ()

    def of(self, structures: Mapping[str, Any]) -> tuple[str, ...]:
        """Return the names of substances that make it, one of each set, or nothing.

        Args:
            structures: RDKit molecules of the canonical forms, by name.
        """
        found = [
            next((name for name, structure in structures.items() if any(matches(structure, item) for item in side)), "")
            for side in (self.a, self.b, self.c)
            if side
        ]
        return tuple(found) if all(found) else ()


class HazardousMixture(Record):
    """Two or three sets of reagents; one of each set in the same experiment is a hazard."""

    a: frozenset[str]
    b: frozenset[str]
    c: frozenset[str] = frozenset()
    hazard: str

    def reagents_in(self, names: frozenset[str]) -> tuple[str, ...]:
        """Return one reagent of each set if all sets are represented among the names, else an empty tuple."""
        sides = [side for side in (self.a, self.b, self.c) if side]
        if all(side & names for side in sides):
            return tuple(min(side & names) for side in sides)
        return ()


class Refusals(Document):
    """The table.

    Attributes:
        products: kinds of substance that are refused as products by the grammar of their names. Azides of alkyl and
            benzyl groups with at least four carbon atoms are not among them: the library makes two, cold, undistilled
            and without chlorinated solvents, which rules of the validation suite enforce.
        makings: structures that together make a dangerous product, also one that the text does not name.
        protic: protic solvents.
        destroyed_by_protic: reagents that react violently with a protic solvent.
    """

    SCHEMA: ClassVar[str] = "labgym.refusals/1"

    wishes: tuple[Wish, ...]
    products: tuple[HazardousProduct, ...]
    makings: tuple[Making, ...]
    mixtures: tuple[HazardousMixture, ...]
    protic: frozenset[str]
    destroyed_by_protic: frozenset[str]


@lru_cache(maxsize=1)
def refusals() -> Refusals:
    """Return the published table; it is read once per process."""
    return Refusals.load(artefacts("assets") / "synthesis" / "refusals.json")


@lru_cache(maxsize=1)
def _patterns() -> tuple[tuple[Wish, re.Pattern[str], re.Pattern[str]], ...]:
    """Return each kind of product with the patterns of its words and of those that must follow."""
    return tuple(
        (
            wish,
            re.compile(rf"\b(?:{wish.english})(?![a-z])", re.IGNORECASE),
            re.compile(wish.followed_by, re.IGNORECASE),
        )
        for wish in refusals().wishes
    )


def refuse_wish(text: str) -> None:
    """Raise an error if a text asks for a dangerous product.

    Raises:
        RefusalError: the text names an explosive, a chemical weapon, a controlled drug or a nitration.
    """
    text = _ACRONYM.sub(lambda match: match[0].replace(".", ""), _latin(text))
    words = _spelled_out(text)
    for wish, pattern, following in _patterns():
        match = pattern.search(text)
        if match is not None and following.search(text, match.end()) is None:
            match = None
        phrase = match[0] if match else next((word for word in wish.chinese if _asks_for(text.lower(), word)), None)
        phrase = phrase or next((name for name in wish.names if any(_is_like(word, name) for word in words)), None)
        made = (formula[1] for formula in _FORMULA.finditer(text) if formula[1] in wish.formulas)
        phrase = phrase or next(made, None)
        if phrase is not None:
            raise RefusalError("unsafe", f"no protocol is written for {wish.what} ({phrase[:60]!r})")


def _spelled_out(text: str) -> frozenset[str]:
    """Return the words of a text, each also joined to the next two, without spaces and hyphens, digits as letters."""
    parts = [re.sub(r"[-_'’]", "", word) for word in _WORDS.findall(text.lower())]
    plain = [word.translate(_DIGITS) for word in parts]
    joined = ("".join(plain[index : index + size]) for index in range(len(plain)) for size in (1, 2, 3))
    return frozenset(word for word in joined if SHORTEST_NAME <= len(word) <= LONGEST_NAME)


def _is_like(word: str, name: str) -> bool:
    """Return whether a word is a name, or differs from it in one letter that is changed, added, left out or swapped."""
    if word == name:
        return True
    if abs(len(word) - len(name)) > 1:
        return False
    start = next(
        (index for index, (a, b) in enumerate(zip(word, name, strict=False)) if a != b), min(len(word), len(name))
    )
    left, right = word[start:], name[start:]
    swapped = len(left) > 1 and len(right) > 1 and left[:2] == right[1::-1] and left[2:] == right[2:]
    return left[1:] == right[1:] or left[1:] == right or left == right[1:] or swapped


def _asks_for(text: str, word: str) -> bool:
    """Return whether a text has a Chinese word that is neither denied nor the end of another: 无毒品, 剧毒品."""
    return re.search(rf"(?<![剧无非不]){re.escape(word)}", text) is not None


@lru_cache(maxsize=1)
def _product_patterns() -> tuple[tuple[HazardousProduct, re.Pattern[str]], ...]:
    return tuple(
        (product, re.compile(rf"(?<![a-z])(?:{product.english})(?![a-z])", re.IGNORECASE))
        for product in refusals().products
    )


def refuse_product(text: str, reagents: Iterable[tuple[int, int]] = ()) -> None:
    """Raise an error if a text names a substance that must not be made.

    Args:
        text: a description, or the name of a product.
        reagents: spans of the text that name reagents of the catalog, which are not made.

    Raises:
        RefusalError: names the substance, its kind and the reason.
    """
    text, spans = _latin(text), tuple(reagents)
    for product, pattern in _product_patterns():
        for match in pattern.finditer(text):
            if not any(start < match.end() and match.start() < end for start, end in spans):
                _refuse(product, match[0])
        for word in product.chinese:
            place = text.find(word)
            if place >= 0 and not any(start <= place < end for start, end in spans):
                _refuse(product, word)


def refuse_structure(smiles: str) -> None:
    """Raise an error if a structure must not be made; an invalid SMILES is not judged.

    Without RDKit (extra `chem`) no structure is judged.

    Raises:
        RefusalError: names the structure, its kind and the reason.
    """
    try:
        structure, spelling = standard(smiles), canonical(smiles)
        refuse_weapon(structure, smiles)
    except (StructureError, MissingDependencyError):
        return
    except ProhibitedSubstanceError as error:
        raise RefusalError("unsafe", f"no protocol makes a chemical weapon: {error}") from None
    for product in refusals().products:
        if product.includes(structure, spelling):
            _refuse(product, smiles)


def is_ordinary_dinitro(smiles: str) -> bool:
    """Return whether a structure is an aromatic dinitro compound that is bought as a reagent and no explosive.

    It has two nitro groups on aromatic carbon, no other group of explosives, and an oxygen balance below
    `DINITRO_BALANCE_PERCENT`. Without RDKit (extra `chem`) none is.
    """
    try:
        structure = standard(smiles)
    except (StructureError, MissingDependencyError):
        return False
    nitro = [len(matches(structure, smarts)) for smarts in ("c[N+](=O)[O-]", "[N+](=O)[O-]", "[F,Cl,Br,I]")]
    if nitro[:2] != [2, 2] or any(matches(structure, smarts) for smarts in _ENERGETIC):
        return False
    count = Counter(atom.GetSymbol() for atom in structure.GetAtoms())
    hydrogens = sum(atom.GetTotalNumHs() for atom in structure.GetAtoms())
    mass = sum(atom.GetMass() for atom in structure.GetAtoms()) + 1.008 * hydrogens
    missing = 2.0 * count["C"] + (hydrogens - nitro[2]) / 2.0 - count["O"]
    return bool(-1600.0 * missing / mass < DINITRO_BALANCE_PERCENT)


def refuse_structures(text: str) -> None:
    """Raise an error if a text contains the SMILES of what must not be made.

    Raises:
        RefusalError: names the first such structure.
    """
    tokens = (match[0].rstrip(".,;:") for match in _TOKEN.finditer(text))
    for smiles in [token for token in tokens if _SMILES.fullmatch(token)][:MAX_STRUCTURES]:
        refuse_structure(smiles)


def refuse_to_make(name: str, product: str, structures: Iterable[str] = ()) -> None:
    """Raise an error if an experiment or protocol makes what must not be made.

    Args:
        name: its name. product: its product as written, a name or a SMILES.
        structures: SMILES of its products.

    Raises:
        RefusalError: names the substance and the reason.
    """
    refuse_wish(f"{name}. {product}.")
    refuse_product(product)
    for smiles in (*(match[0] for match in _TOKEN.finditer(product)), *structures):
        refuse_structure(smiles)


def _latin(text: str) -> str:
    """Return a text with letters that look like Latin ones as Latin ones; each character stays at its place."""
    if text.isascii():
        return text
    plain = (unicodedata.normalize("NFKD", char) for char in text.translate(_CONFUSABLE))
    return "".join(
        form[0] if form.isascii() or unicodedata.combining(form[-1]) else char
        for form, char in zip(plain, text.translate(_CONFUSABLE), strict=True)
    )


def _refuse(product: HazardousProduct, name: str) -> None:
    raise RefusalError("unsafe", f"no protocol makes {product.what} ({name.strip()[:60]!r}): {product.why}")


def refuse_mixture(reagents: Iterable[str]) -> None:
    """Raise an error if reagents must not be part of one experiment.

    Args:
        reagents: canonical asset names.

    Raises:
        RefusalError: some of them must never meet; the error names them and the hazard.
    """
    names = frozenset(reagents)
    for mixture in refusals().mixtures:
        hazardous = mixture.reagents_in(names)
        if hazardous:
            raise RefusalError(
                "unsafe", f"{' and '.join(hazardous)} must not be part of one experiment: {mixture.hazard}"
            )


def refuse_making(structures: Mapping[str, str]) -> None:
    """Raise an error if the substances of an experiment together make what must not be made.

    Without RDKit (extra `chem`) no structure is judged.

    Args:
        structures: SMILES by name.

    Raises:
        RefusalError: names the substances and what they make.
    """
    known: dict[str, Any] = {}
    for name, smiles in structures.items():
        try:
            known[name] = standard(smiles)
        except (StructureError, MissingDependencyError):
            continue
    for making in refusals().makings:
        names = making.of(known)
        if names:
            raise RefusalError("unsafe", f"{' and '.join(dict.fromkeys(names))} make {making.what}: no protocol does")


def refuse_solvent(reagents: Iterable[str], solvents: Iterable[str]) -> None:
    """Raise an error if a solvent of a reaction destroys one of its reagents.

    Args:
        reagents, solvents: canonical asset names.

    Raises:
        RefusalError: a protic solvent would destroy a hydride or organometallic reagent violently.
    """
    table = refusals()
    reactive = sorted(table.destroyed_by_protic.intersection(reagents))
    protic = sorted(table.protic.intersection(solvents))
    if reactive and protic:
        raise RefusalError("unsafe", f"{reactive[0]} reacts violently with {protic[0]}: name an aprotic solvent")
