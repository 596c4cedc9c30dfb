"""The sealed split: seeds by a public formula, a commitment that nothing else meets, and the command that checks it."""

from __future__ import annotations

import hashlib

import pytest

from labgym.cli import main
from labgym.counts import MAX_SEED
from labgym.errors import DocumentError, OptionError
from labgym.eval.driving import floor_suites
from labgym.eval.driving.floor_suites import commitment_to, floor_suite, suite_floors
from labgym.layouts import sealed
from labgym.layouts.floors import SPLITS
from labgym.layouts.sealed import Commitment, read_secret, sealed_seeds

SECRET = bytes(range(32))


def test_seeds_follow_from_the_secret_by_sha256():
    seeds = list(sealed_seeds(SECRET, 17))
    for attempt, seed in enumerate(seeds):
        digest = hashlib.sha256(SECRET + f":17:{attempt}".encode()).hexdigest()
        assert seed == 10**10 + int(digest, 16) % (MAX_SEED - 10**10)
    others = [next(iter(sealed_seeds(SECRET, index))) for index in range(100)]
    assert len({*seeds, *others}) == len(seeds) + 99
    assert min(others) >= 10**10
    assert max(others) <= MAX_SEED


def test_the_secret_is_64_hexadecimal_digits(tmp_path):
    path = tmp_path / "secret.txt"
    path.write_text(f"{SECRET.hex()}\n")
    assert read_secret(path) == SECRET
    for text in ("", SECRET.hex()[:-1], SECRET.hex().upper(), f"{SECRET.hex()} {SECRET.hex()}"):
        path.write_text(text)
        with pytest.raises(DocumentError, match="64 hexadecimal digits"):
            read_secret(path)
    with pytest.raises(DocumentError, match="no such file"):
        read_secret(tmp_path / "other.txt")


def test_only_the_sealed_split_takes_a_secret_and_it_needs_one(tmp_path):
    for arguments in ({"split": "floors-sealed"}, {"split": "floors-test", "secret": SECRET}):
        with pytest.raises(OptionError, match="--secret-file"):
            floor_suite(count=1, out=tmp_path, **arguments)
    with pytest.raises(OptionError, match="--secret-file"):
        floor_suite("floors-sealed", 1, tmp_path, seed=0, secret=SECRET)


def test_the_command_makes_the_floors_again_and_compares_their_hashes(tmp_path, monkeypatch, capsys):
    """One floor, made once: about 1 s."""
    monkeypatch.setitem(SPLITS, "floors-sealed", SPLITS["floors-train"][:1])
    out, secret = tmp_path / "out", tmp_path / "secret.txt"
    secret.write_text(SECRET.hex())
    suite = floor_suite("floors-sealed", 1, out, secret=SECRET, progress=False)
    (layout,) = suite_floors(suite, out)
    assert layout.id == "floors-sealed-0000"
    assert layout.provenance.seed in list(sealed_seeds(SECRET, 0))
    assert all(SECRET.hex() not in path.read_text() for path in out.rglob("*.json*"))
    committed = commitment_to(SECRET, suite, [layout])
    assert committed.secret == hashlib.sha256(SECRET).hexdigest()
    assert [(floor.id, floor.hash) for floor in committed.floors] == [(layout.id, layout.hash)]
    command = ["floors", "--split", "floors-sealed", "--count", "1", "--secret-file", str(secret), "--out", str(out)]
    monkeypatch.setattr(floor_suites, "make_floor", None)  # the folder is finished
    for stored, code in ((None, 0), (committed, 0), (committed.model_copy(update={"suite": "0" * 64}), 1)):
        monkeypatch.setattr(sealed, "commitment", lambda stored=stored: stored)
        assert main(command) == code
    printed = capsys.readouterr()
    assert "have the hashes of the published commitment" in printed.out
    assert "the suite's hash is" in printed.err
    assert Commitment.load(out / "commitment.json") == committed


def test_every_difference_from_a_commitment_is_named():
    floors = tuple(sealed.SealedFloor(id=f"floors-sealed-{k:04d}", hash=f"{k:064x}") for k in range(3))
    one = Commitment(secret="a" * 64, furnisher=1, labgym="0.2.0", floors=floors, suite="b" * 64)
    assert one.differences(one) == ()
    other = one.model_copy(update={"floors": (floors[0], floors[2]), "furnisher": 2, "secret": "c" * 64})
    text = "\n".join(one.differences(other))
    for words in ("secret's SHA-256", "furnisher 2", "2 floors, committed 3", "floors-sealed-0002: hash"):
        assert words in text
