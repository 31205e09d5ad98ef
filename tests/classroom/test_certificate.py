"""The certificate of a class in a network."""

import datetime
import ssl
import stat
from pathlib import Path

import pytest

from lab.classroom.certificate import DAYS, fingerprint, made_certificate
from lab.errors import BadInput
from lab.operating_system import WINDOWS

NOW = datetime.datetime(2026, 1, 2, tzinfo=datetime.UTC)


def test_it_is_for_the_hosts_and_its_key_is_for_its_owner_alone(tmp_path: Path) -> None:
    certificate, key = made_certificate(tmp_path, ["lab.example", "192.0.2.7"], NOW)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, key)
    told = ssl._ssl._test_decode_cert(str(certificate))  # type: ignore[attr-defined]
    assert told["subjectAltName"] == (("DNS", "lab.example"), ("IP Address", "192.0.2.7"))
    if not WINDOWS:
        assert stat.S_IMODE(key.stat().st_mode) & 0o077 == 0


def test_it_is_made_once(tmp_path: Path) -> None:
    certificate, _ = made_certificate(tmp_path, ["192.0.2.7"], NOW)
    before = fingerprint(certificate)
    made_certificate(tmp_path, ["192.0.2.7"], NOW)
    assert fingerprint(certificate) == before
    assert len(before) == 32 * 3 - 1


def test_it_is_made_anew_for_other_hosts_and_when_it_ends(tmp_path: Path) -> None:
    certificate, _ = made_certificate(tmp_path, ["192.0.2.7"], NOW)
    before = fingerprint(certificate)
    made_certificate(tmp_path, ["192.0.2.8"], NOW)
    other = fingerprint(certificate)
    made_certificate(tmp_path, ["192.0.2.8"], NOW + datetime.timedelta(days=DAYS))
    assert len({before, other, fingerprint(certificate)}) == 3


def test_what_is_no_certificate_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.pem").write_text("x")
    for path in (tmp_path / "x.pem", tmp_path / "none.pem"):
        with pytest.raises(BadInput, match=path.name):
            fingerprint(path)
