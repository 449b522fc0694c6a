"""The page of a study in a browser: plots without an error, and a click that gives a command."""

from phasmid.studies import study
from support.browsers import NEEDED, is_ours, started

pytestmark = NEEDED


def test_a_click_on_a_point_gives_its_command(tmp_path):
    one = {
        "kind": "plan",
        "set": {"duration": 0.5},
        "metrics": ["energy.cost_of_transport"],
        "axes": {"gait": ["tripod", "wave"], "step_length_mm": [20, 40, 60]},
    }
    results = study(one, out=tmp_path / "out", workers=1)
    with started() as browser:
        window = browser.new_page(viewport={"width": 1000, "height": 800})
        errors = []
        window.on("console", lambda message: is_ours(message) and errors.append(message.text))
        window.on("pageerror", lambda error: errors.append(str(error)))
        window.goto((results.folder / "study.html").as_uri())
        assert window.locator("#best tbody tr").count() == 6
        window.locator("#best tbody tr").first.click()
        best = int(results.table.sort_values("energy.cost_of_transport")["number"].iloc[0])
        assert window.locator("#chosen pre").text_content().endswith(f" --only {best}")
        window.locator("#scatter").click(position={"x": 70, "y": 60})
        assert " --only " in window.locator("#chosen pre").text_content()
        assert window.locator("#effects canvas").count() == 2
        assert errors == []
