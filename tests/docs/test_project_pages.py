"""Pages in the folder of the project, and the workflows: links, places in pages, versions, pinned actions."""

from __future__ import annotations

import re

import pytest

from tests.docs import snippets
from tests.docs.snippets import ROOT

PAGES = sorted(ROOT.glob("*.md"))
WORKFLOWS = sorted((ROOT / ".github" / "workflows").glob("*.yml"))


def places(text: str) -> set[str]:
    """Names that links give to the headings of a page."""
    headings = re.findall(r"(?m)^#+ (.+)$", text)
    return {re.sub(r"[^\w -]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=snippets.name_of)
def test_links_lead_to_files_and_places(page):
    text = page.read_text(encoding="utf-8")
    for target in snippets.links(page):
        assert (ROOT / target).exists(), target
    for path, place in re.findall(r"\]\(([^):#]+\.md)#([^)]+)\)", text):
        assert place in places((ROOT / path).read_text(encoding="utf-8")), f"{path}#{place}"


def test_the_pages_that_a_project_has_are_there():
    names = {"README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "CODE_OF_CONDUCT.md"}
    assert names <= {page.name for page in PAGES}


def test_the_citation_is_of_this_version():
    stated = re.search(r'(?m)^version = "(.+)"$', (ROOT / "pyproject.toml").read_text(encoding="utf-8"))[1]
    assert f"\nversion: {stated}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_the_security_page_names_its_test():
    (named,) = re.findall(r"`(tests/\S+\.py)`", (ROOT / "SECURITY.md").read_text(encoding="utf-8"))
    assert (ROOT / named).is_file()


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_a_workflow_pins_its_actions_and_may_read_only(path):
    text = path.read_text(encoding="utf-8")
    used = re.findall(r"uses: (\S+)( # v[\d.]+)?", text)
    assert used
    for action, version in used:
        assert re.fullmatch(r"[\w./-]+@[0-9a-f]{40}", action), action
        assert version, f"{action} names no version"
    assert "\npermissions:\n  contents: read\n" in text
    assert set(re.findall(r"(?m)^ +([\w-]+): write\b", text)) <= {"id-token"}


def test_workflows_install_as_the_readme_says():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    small = re.search(r"pip install -c constraints\.txt --no-deps torch \S+ \S+", readme)[0]
    for path in WORKFLOWS:
        text = path.read_text(encoding="utf-8")
        assert ("[dev]" in text) == (f"python -m {small}\n" in text), path.name
