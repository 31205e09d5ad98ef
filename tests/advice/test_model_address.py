"""The addresses of language models: what is taken from them, and what is refused without being shown."""

import pytest

from lab.advice.advisors import AdvisorName, is_external
from lab.advice.model_address import MOST_CALLS, TIMEOUT_S, ModelAddress
from lab.errors import BadInput


@pytest.mark.parametrize(
    ("text", "address"),
    [
        ("http://127.0.0.1:8080/v1", ModelAddress("http", "127.0.0.1", 8080, "/v1/chat/completions")),
        ("http://localhost", ModelAddress("http", "localhost", 80, "/v1/chat/completions")),
        ("https://example.org/", ModelAddress("https", "example.org", 443, "/v1/chat/completions")),
        ("https://example.org/a/chat/completions", ModelAddress("https", "example.org", 443, "/a/chat/completions")),
        ("http://[::1]:8080/v1", ModelAddress("http", "::1", 8080, "/v1/chat/completions")),
        ("http://h/v1#a/b-1.5:8b", ModelAddress("http", "h", 80, "/v1/chat/completions", "a/b-1.5:8b")),
        (
            "http://h/v1#m,timeout=0.5,calls=7,unencrypted",
            ModelAddress("http", "h", 80, "/v1/chat/completions", "m", 0.5, 7, True),
        ),
        ("http://h/v1#timeout=30", ModelAddress("http", "h", 80, "/v1/chat/completions", "", 30.0)),
        ("http://h/v1#unencrypted", ModelAddress("http", "h", 80, "/v1/chat/completions", unencrypted=True)),
    ],
)
def test_an_address_is_parsed_once(text: str, address: ModelAddress) -> None:
    name = AdvisorName.of(f"llm:{text}")
    assert (name.model, name.row, str(name)) == (address, "llm:URL", f"llm:{text}")


def test_limits_have_defaults() -> None:
    address = ModelAddress.of("http://h")
    assert (
        (address.timeout_s, address.most_calls, address.unencrypted)
        == (TIMEOUT_S, MOST_CALLS, False)
        == (10.0, 1000, False)
    )


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("", "it names no server: wanted llm:http://"),
        ("127.0.0.1:8080", "is no address of a server: wanted llm:http://127.0.0.1:8080/v1#MODEL, http or https"),
        ("ftp://h/v1", "is no address of a server"),
        ("file:///etc/passwd", "is no address of a server"),
        ("http://:80/v1", "is no address of a server"),
        ("http://h:0/v1", "is no address of a server"),
        ("http://h:99999/v1", "its address is no URL"),
        ("http://[h/v1", "its address is no URL"),
        ("http://h/v1 x", "printable ASCII without spaces"),
        ("http://h/v1\r\nHost: x", "printable ASCII without spaces"),
        ("http://hö/v1", "printable ASCII without spaces"),
        (f"http://h/{'x' * 500}", "printable ASCII without spaces"),
        ("http://h/v1#m,timeout=0", "'timeout=0' after the model's name: wanted timeout=SECONDS"),
        ("http://h/v1#m,timeout=nan", "'timeout=nan' after"),
        ("http://h/v1#m,timeout=601", "'timeout=601' after"),
        ("http://h/v1#m,calls=0", "'calls=0' after"),
        ("http://h/v1#m,calls=2.5", "'calls=2.5' after"),
        ("http://h/v1#m,insecure", "'insecure' after the model's name"),
    ],
)
def test_what_is_no_address_is_refused_in_one_line(text: str, fault: str) -> None:
    with pytest.raises(BadInput) as refused:
        AdvisorName.of(f"llm:{text}", "--advisor")
    assert fault in str(refused.value)
    assert "(--advisor)" in str(refused.value)


@pytest.mark.parametrize(
    "text",
    ["http://me:secret@h/v1", "http://secret@h/v1", "http://@h/secret", "http://h/v1?key=secret", "http://h/secret?"],
)
def test_a_key_in_an_address_is_refused_and_not_shown(text: str) -> None:
    with pytest.raises(BadInput, match="the key belongs in LAB_LLM_KEY") as refused:
        AdvisorName.of(f"llm:{text}")
    assert "secret" not in str(refused.value)


@pytest.mark.parametrize(
    ("host", "is_local"),
    [("localhost", True), ("127.0.0.1", True), ("127.9.9.9", True), ("[::1]", True), ("10.0.0.1", False), ("h", False)],
)
def test_which_servers_are_on_this_computer(host: str, is_local: bool) -> None:
    assert ModelAddress.of(f"http://{host}/v1").is_local is is_local


def test_who_is_asked_outside_the_lab() -> None:
    names = ("terminal", "web", "llm:http://h", "expert", "policy:llm", "none")
    assert [is_external(name) for name in names] == [True, True, True, False, False, False]
