from __future__ import annotations

from labgym.runs.folder import remove_folder


def test_a_folder_goes_with_all_its_files_and_what_its_links_lead_to_stays(tmp_path):
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "kept").write_text("1")
    folder = tmp_path / "run" / "shards"
    for number in range(1000):
        path = folder / f"{number % 7}" / f"{number}"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("x")
    (folder / "empty" / "nested").mkdir(parents=True)
    (folder / "link").symlink_to(outside)
    (folder / "file link").symlink_to(outside / "kept")
    remove_folder(folder)
    assert not folder.exists()
    assert (tmp_path / "run").is_dir()
    assert (outside / "kept").read_text() == "1"


def test_a_link_to_a_folder_stays_with_the_files_behind_it(tmp_path):
    (tmp_path / "scratch").mkdir()
    (tmp_path / "scratch" / "kept").write_text("1")
    (tmp_path / "shards").symlink_to(tmp_path / "scratch")
    remove_folder(tmp_path / "shards")
    assert (tmp_path / "shards" / "kept").read_text() == "1"


def test_a_folder_that_does_not_exist_is_no_error(tmp_path):
    remove_folder(tmp_path / "none")
