"""A certificate that is made for a class on a network: kept in the class's folder, and known by its fingerprint."""

import datetime
import os
from collections.abc import Sequence
from ipaddress import ip_address
from pathlib import Path

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from lab.errors import BadInput
from lab.files import is_file, read_limited, write_whole

CERTIFICATE, KEY = "certificate.pem", "key.pem"
DAYS = 365
MOST_BYTES = 1 << 20


def made_certificate(folder: Path, hosts: Sequence[str], now: datetime.datetime) -> tuple[Path, Path]:
    """The files of a certificate for these hosts and of its key, which are made if the folder has none that fits and holds.

    Raises BadInput if they cannot be written.
    """
    certificate, key = folder / CERTIFICATE, folder / KEY
    if is_file(certificate) and is_file(key) and _fits(certificate, hosts, now):
        return certificate, key
    own = ec.generate_private_key(ec.SECP256R1())
    name = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "Teaching lab class")])
    made = (
        x509.CertificateBuilder()
        .subject_name(name)
        .issuer_name(name)
        .public_key(own.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - datetime.timedelta(days=1))
        .not_valid_after(now + datetime.timedelta(days=DAYS))
        .add_extension(x509.SubjectAlternativeName([_alternative(host) for host in hosts]), critical=False)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .sign(own, hashes.SHA256())
    )
    secret = own.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    try:
        before = os.umask(0o077)
        try:
            write_whole(key, secret)
        finally:
            os.umask(before)
        write_whole(certificate, made.public_bytes(serialization.Encoding.PEM))
    except OSError as error:
        raise BadInput(f"certificate of the class in '{folder}': {error.strerror or error}") from None
    return certificate, key


def fingerprint(certificate: Path) -> str:
    """The SHA-256 of a certificate, as browsers show it. Raises BadInput for a file that is none."""
    return ":".join(f"{byte:02X}" for byte in _read(certificate).fingerprint(hashes.SHA256()))


def _read(certificate: Path) -> x509.Certificate:
    try:
        return x509.load_pem_x509_certificate(read_limited(certificate, MOST_BYTES))
    except OSError as error:
        raise BadInput(f"certificate '{certificate}' (--certificate): {error.strerror or error}") from None
    except ValueError:
        raise BadInput(f"certificate '{certificate}' (--certificate): a PEM file of a certificate is wanted") from None


def _fits(certificate: Path, hosts: Sequence[str], now: datetime.datetime) -> bool:
    """Whether a certificate is for all of these hosts, and valid for another day."""
    read = _read(certificate)
    try:
        named = read.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except x509.ExtensionNotFound:
        return False
    return read.not_valid_after_utc > now + datetime.timedelta(days=1) and {*map(_alternative, hosts)} <= {*named}


def _alternative(host: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ip_address(host))
    except ValueError:
        return x509.DNSName(host)
