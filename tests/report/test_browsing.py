"""The tools of the browser tests find what they are there to find."""

from __future__ import annotations

import pytest

WHOLE = '<!doctype html><html lang="en"><head><title>A page</title>{}</head><body><main><h1>A page</h1>{}</main></body></html>'


@pytest.fixture
def page(tmp_path):
    def write(head: str = "", body: str = ""):
        path = tmp_path / "page.html"
        path.write_text(WHOLE.format(head, body), encoding="utf-8")
        return path

    return write


def test_a_page_without_faults_has_none(visit, page):
    with visit(page()) as seen:
        assert seen.axe() == []
        assert seen.overflow() == 0


@pytest.mark.parametrize(
    ("head", "body", "fault"),
    [
        ("", "<script>console.error('oh')</script>", "oh"),
        ("", "<script>console.warn('mind')</script>", "mind"),
        ("", "<script>throw new Error('broken')</script>", "broken"),
        ("", '<img alt="a dot" src="http://192.0.2.1/dot.png">', "192.0.2.1"),
        ("", '<img alt="a dot" src="other.png">', "other.png"),
        (
            "<meta http-equiv='Content-Security-Policy' content=\"default-src 'none'\">",
            "<script>1</script>",
            "policy violated: script-src-elem",
        ),
    ],
)
def test_a_fault_fails_the_visit(visit, page, head, body, fault):
    with pytest.raises(AssertionError, match=fault), visit(page(head, body)):
        pass


def test_what_people_cannot_read_is_found(visit, page):
    with visit(
        page(
            body='<p style="color:#ccc;background:#fff">pale</p><img src="data:image/gif;base64,R0lGODlhAQABAAAAACw=">'
        )
    ) as seen:
        rules = {sentence.partition(":")[0] for sentence in seen.axe()}
    assert {"color-contrast", "image-alt"} <= rules


def test_what_is_too_wide_is_found(visit, page):
    with visit(page(body='<div style="width:500px">wide</div>'), width=375) as seen:
        assert seen.overflow() > 100
