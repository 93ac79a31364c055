"""Files are there whole or not at all."""

import errno
import os
from pathlib import Path

import pytest

from vrdp_prob.errors import InputError
from vrdp_prob.files import check_writable, own_folders, write_atomically


def test_the_file_appears_when_the_block_ends(tmp_path: Path) -> None:
    with write_atomically(tmp_path / "new" / "a.txt") as temporary:
        temporary.write_text("whole")
        assert not (tmp_path / "new" / "a.txt").exists()
    assert (tmp_path / "new" / "a.txt").read_text() == "whole"


@pytest.mark.parametrize("interruption", [KeyboardInterrupt, ValueError])
def test_an_interruption_leaves_what_was_there(tmp_path: Path, interruption: type[BaseException]) -> None:
    (tmp_path / "a.txt").write_text("before")

    def write() -> None:
        with write_atomically(tmp_path / "a.txt") as temporary:
            temporary.write_text("half")
            raise interruption

    with pytest.raises(interruption):
        write()
    assert [path.name for path in tmp_path.iterdir()] == ["a.txt"]
    assert (tmp_path / "a.txt").read_text() == "before"


def test_a_video_has_a_folder_of_its_own_whatever_it_is_called() -> None:
    assert own_folders(["a", "b c.mp4"]) == {"a": "a", "b c.mp4": "b c.mp4"}
    assert own_folders(["/x/y", "..", "."]) == {"/x/y": "_x_y", "..": "__", ".": "_"}
    with pytest.raises(InputError, match="video 'a_b': another one would be written to the folder 'a_b' too"):
        own_folders(["a/b", "a_b"])


def test_a_folder_whose_name_cannot_be_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="the folder cannot be written"):
        check_writable(tmp_path / ("a" * 300))


def test_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    with pytest.raises(InputError, match="the folder cannot be written"), write_atomically(tmp_path / "file" / "a.txt"):
        pass


def test_a_folder_in_the_way(tmp_path: Path) -> None:
    (tmp_path / "a.txt").mkdir()
    with pytest.raises(InputError, match="a folder has its name"), write_atomically(tmp_path / "a.txt"):
        pytest.fail("the work began")


def test_a_full_disk_is_one_sentence(tmp_path: Path) -> None:
    message = r"a\.txt: the file cannot be written \(No space left"
    with pytest.raises(InputError, match=message), write_atomically(tmp_path / "a.txt"):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    assert list(tmp_path.iterdir()) == []
