"""What README and docs tell users to type exists: verbs, flags, targets, scripts, names, links; cheap ones are run."""

import ast
import importlib
import re

import pytest

from hemline import garments
from hemline.cli import main
from hemline.cli.main import VERBS
from hemline.garments.reading.garment_toml import read_garment_toml
from tests.promises.pages import PAGES, ROOT, anchors, blocks, commands, links

README = ROOT / "README.md"
TYPED = [(page.name, words) for page in PAGES for words in commands(page)]


def flags(verb: str, capsys) -> set[str]:
    """All flags of a verb, as its own help lists them."""
    with pytest.raises(SystemExit) as stop:
        main([verb, "--help"])
    assert not stop.value.code
    return set(re.findall(r"(?<![\w-])--?[a-z][a-z0-9-]*", capsys.readouterr().out))


def ids(typed):
    return f"{typed[0]}: {' '.join(typed[1])}"


@pytest.mark.parametrize("typed", [each for each in TYPED if each[1][0] == "hemline"], ids=ids)
def test_verbs_and_flags_exist(typed, capsys):
    words = typed[1]
    assert words[1] in VERBS or words[1].isupper()
    if words[1] in VERBS:
        known = flags(words[1], capsys)
        for word in words[2:]:
            if re.match(r"--?[a-z]", word):
                assert word in known, f"'hemline {words[1]}' has no {word}"


@pytest.mark.parametrize("typed", [each for each in TYPED if each[1][0] != "hemline"], ids=ids)
def test_targets_and_scripts_exist(typed):
    program, *words = typed[1]
    if program == "make":
        targets = re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
        assert words[0] in targets
    elif words[0] == "-m":
        places = (root / words[1].replace(".", "/") for root in (ROOT / "src", ROOT))
        ours = any(place.with_suffix(".py").exists() for place in places)
        assert ours or words[1] in ("pytest", "http.server")
    else:
        assert (ROOT / words[0]).exists()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page):
    for target in links(page):
        path, _, anchor = target.partition("#")
        other = (page.parent / path).resolve() if path else page
        assert other.exists(), f"{page.name}: {target}"
        assert not anchor or anchor in anchors(other), f"{page.name}: {target}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_files_that_are_named_exist(page):
    roots = [ROOT, page.parent, *(ROOT / each for each in ("src/hemline", "src/hemline/sim", "src/hemline/animators"))]
    for name in re.findall(r"`([\w/.-]+/[\w.-]+\.(?:py|md|toml|bib|txt|safetensors))`", page.read_text()):
        assert any((root / name).exists() for root in roots), f"{page.name}: there is no {name}"


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_names_in_python_blocks_exist(page):
    for block in blocks(page, "python") if page.name != "design.md" else []:  # signatures there, no code
        for node in ast.walk(ast.parse(block)):
            names = ast.unparse(node).split(".") if isinstance(node, ast.Attribute) else []
            if names[:1] == ["hemline"] and all(name.isidentifier() for name in names):
                found = importlib.import_module("hemline")
                for name in names[1:]:
                    found = getattr(found, name)


def test_the_ten_lines_run():
    first, loop = blocks(README, "python")
    drawn = []
    scope = {"draw": lambda vertices, faces: drawn.append((vertices.shape, str(vertices.dtype), len(faces)))}
    exec(compile(first, "README.md", "exec"), scope)
    assert drawn[0][:2] == ((12690, 3), "float32") and len(drawn) > 60
    scope["pose"] = scope["body"].placed(scope["run"])[0]
    exec(compile(loop, "README.md", "exec"), scope)
    assert scope["frame"].vertices.shape == (12690, 3)
    scope |= {name: [scope[name[:-1]]] for name in ("players", "states", "poses")}
    (many,) = [code for code in re.findall(r"`([^`\n]+)`", README.read_text()) if "hemline.crowd(" in code]
    exec(many, scope)
    assert len(scope["frames"]) == 1


def test_tables_that_pages_show_can_be_read(tmp_path):
    shown = [block for page in PAGES for block in blocks(page, "toml") if block.startswith("mesh")]
    assert len(shown) == 2
    for number, block in enumerate(shown):
        (tmp_path / f"{number}.toml").write_text(block)
        assert read_garment_toml(tmp_path / f"{number}.toml").mesh.endswith(".obj")


@pytest.mark.slow
def test_the_commands_for_an_own_garment_run_as_they_stand(tmp_path, monkeypatch):
    """On the shipped T-shirt as somebody's mesh, in a minute instead of ten."""
    monkeypatch.chdir(tmp_path)
    shirt = garments.load("tshirt-light")
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in shirt.vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in shirt.faces.tolist()]
    (tmp_path / "my_jacket.obj").write_text("\n".join(lines) + "\n")
    shorter = {"make": ["--minutes", "1"]}
    typed = [words for words in commands(README) if words[0] == "hemline" and any("jacket" in w for w in words)]
    assert [words[1] for words in typed] == ["make", "animate", "evaluate", "animate"]
    for _, verb, *rest in typed:
        assert main([verb, *rest, *shorter.get(verb, [])]) in (0, 0 if verb == "animate" else 1), verb
    assert (tmp_path / "dance.glb").stat().st_size > 1e6


def test_the_reader_of_pages_finds_commands():
    assert ["make", "demo"] in commands(README)
    assert len([1 for _, words in TYPED if words[0] == "hemline"]) > 20
