"""The site in headless Chromium: a click through every view, by mouse and by keyboard, without an error."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest
from headless_browser import Tab, browser, chromium
from labnav_folders import line_to_goal, write_folder

from labgym.envs.labnav.episodes import published_episodes
from labgym.eval.labnav.evaluation import LabNavEvaluation
from labgym.eval.labnav.suites import LabNavSuite
from labgym.eval.leaderboard.labnav import published_results
from labgym.eval.reports.labnav_report import report_labnav, write_leaderboard
from labgym.eval.reports.site.episodes import episodes_shown

pytestmark = pytest.mark.skipif(chromium() is None, reason="needs Chromium (Debian: apt install chromium)")
VIEWS = ("leaderboard", "tasks", "policies", "episodes", "pairs", "about")

FAINT = r"""(() => {
  const context = document.createElement('canvas').getContext('2d', {willReadFrequently: true});
  const rgba = (color) => {
    context.clearRect(0, 0, 1, 1); context.fillStyle = color; context.fillRect(0, 0, 1, 1);
    const [r, g, b, a] = context.getImageData(0, 0, 1, 1).data;
    return [r, g, b, a / 255];
  };
  const over = (top, below) => [0, 1, 2].map((k) => top[k] * top[3] + below[k] * (1 - top[3]));
  const light = (color) => {
    const [r, g, b] = color.map((v) => v / 255 <= 0.03928 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const behind = (element) => {
    const layers = [];
    for (let one = element; one; one = one.parentElement) layers.push(rgba(getComputedStyle(one).backgroundColor));
    return layers.reduceRight((below, top) => over(top, below), [255, 255, 255]);
  };
  const faint = [];
  for (const element of document.querySelectorAll('body *')) {
    if (element.closest('svg, script, option, .hidden') || !element.checkVisibility()) continue;
    const own = [...element.childNodes].filter((one) => one.nodeType === 3).map((one) => one.data.trim()).join('');
    const label = element.dataset.label && getComputedStyle(element, '::before').content !== 'none';
    for (const [text, style] of [[own, getComputedStyle(element)], [label, getComputedStyle(element, '::before')]]) {
      if (!text) continue;
      const below = behind(element);
      const [x, y] = [light(over(rgba(style.color), below)), light(below)].sort((a, b) => b - a);
      const ratio = (x + 0.05) / (y + 0.05);
      if (ratio < (parseFloat(style.fontSize) >= 24 ? 3 : 4.5)) faint.push(`${element.outerHTML} ${ratio}`);
    }
  }
  return faint;
})()"""
"""Texts of the view whose contrast with their background is below 4.5, or 3 for large ones (WCAG 2.2, 1.4.3)."""


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    suite = LabNavSuite("labnav-people-2", (published_episodes("people", 2).first(2, 2),))
    home = tmp_path_factory.mktemp("runs")
    folders = [
        write_folder(home / "first", suite, "first", "deployed", lambda _, one: 0.4 + 0.1 * one.number, line_to_goal),
        write_folder(home / "second", suite, "second", "deployed", lambda _, one: 0.9 * one.number, line_to_goal),
        write_folder(home / "third", suite, "third", "mapless", lambda _, __: 0.0, line_to_goal),
    ]
    report_labnav(folders, published=())
    return folders[0] / "report.html"


@pytest.fixture(scope="module")
def tab(tmp_path_factory):
    with browser(tmp_path_factory.mktemp("profile")) as opened:
        yield opened


def opened(tab: Tab, page: Path, address: str = "", width: int = 1280, mobile: bool = False) -> Tab:
    tab.open("about:blank", width, 860, mobile)
    tab.open(f"{page.as_uri()}#{address}", width, 860, mobile)
    tab.wait("document.readyState === 'complete' && document.documentElement.classList.contains('scripted')")
    return tab


def visible(tab: Tab) -> list[str]:
    return tab.value("[...document.querySelectorAll('.view')].filter((one) => !one.hidden).map((one) => one.id)")


def pressed(tab: Tab, key: str) -> None:
    text = {"text": "\r"} if key == "Enter" else {}
    codes = {"Enter": 13, "Tab": 9, "ArrowRight": 39, "ArrowDown": 40, "End": 35, "Home": 36, " ": 32}
    for kind in ("keyDown", "keyUp"):
        tab.call("Input.dispatchKeyEvent", type=kind, key=key, code=key, windowsVirtualKeyCode=codes[key], **text)


def changed(tab: Tab, name: str, value: str) -> None:
    tab.value(f"{{const one = document.getElementById('{name}'); one.value = '{value}';"
              " one.dispatchEvent(new Event('change')); one.dispatchEvent(new Event('input'));}")  # fmt: skip


def names_in(tab: Tab, track: str) -> list[str]:
    return tab.value(
        f"[...document.querySelectorAll('[data-track={track}] th[scope=row] a')].map((one) => one.textContent)"
    )


def test_every_view_opens_by_a_click_and_fits_desktop_and_phone(tab, page):
    for width, mobile in ((1280, False), (360, True)):
        opened(tab, page, width=width, mobile=mobile)
        for view in VIEWS:
            tab.value(f"document.querySelector('nav a[href=\"#{view}\"]').click()")
            tab.wait(f"!document.getElementById('{view}').hidden")
            assert visible(tab) == [view]
            assert tab.value("document.documentElement.scrollWidth") <= width
            assert tab.value("document.querySelector('nav ul').scrollWidth") <= width
    assert tab.errors == []


def test_a_column_sorts_by_the_keyboard_and_says_so(tab, page):
    opened(tab, page)
    assert names_in(tab, "deployed") == ["first", "second"]
    tab.value("document.querySelectorAll('.board thead button')[2].focus()")
    pressed(tab, "Enter")
    assert tab.value("document.querySelectorAll('.board thead th')[2].ariaSort") == "descending"
    assert names_in(tab, "deployed") == ["first", "second"]
    pressed(tab, "Enter")
    assert tab.value("document.querySelectorAll('.board thead th')[2].ariaSort") == "ascending"
    assert names_in(tab, "deployed") == ["second", "first"]
    assert tab.value("document.querySelectorAll('.board [aria-sort]').length") == 1
    assert tab.errors == []


def test_a_track_can_be_chosen(tab, page):
    opened(tab, page)
    tab.value("document.querySelector('input[value=mapless]').click()")
    shown = (
        "[...document.querySelectorAll('.board tbody')].filter((one) => !one.hidden).map((one) => one.dataset.track)"
    )
    assert tab.value(shown) == ["mapless"]
    tab.value("document.querySelector('input[name=track]').click()")
    assert tab.value(shown) == ["deployed", "mapless"]


@pytest.fixture
def few_episodes(monkeypatch):
    """Let the viewer of the page show two episodes."""
    monkeypatch.setattr("labgym.eval.reports.site.page.episodes_shown", partial(episodes_shown, most=2))


@pytest.mark.usefixtures("few_episodes")
def test_a_kind_and_a_track_can_be_chosen_together(tab, tmp_path):
    results = [one for one in published_results() if one.summary.policy in ("stack", "ppo", "straight")]
    opened(tab, write_leaderboard(tmp_path, results))
    rows = "[...document.querySelectorAll('.board tr')].filter((one) => one.checkVisibility())"
    names = f"{rows}.flatMap((one) => [...one.querySelectorAll('th a')].map((link) => link.textContent))"
    assert sorted(tab.value(names)) == ["ppo", "stack", "straight"]
    for kind, shown in (("classical", ["stack"]), ("reference", ["straight"]), ("learned", ["ppo"])):
        tab.value(f"document.querySelector('input[value={kind}]').click()")
        assert tab.value(names) == shown
        assert tab.value(f"{rows}.length") == 3  # the headings, the track and the policy
    tab.value("document.querySelector('input[value=deployed]').click()")
    assert tab.value(names) == []
    assert tab.errors == []


@pytest.mark.usefixtures("few_episodes")
def test_long_names_do_not_push_a_task_out_of_the_table(tab, tmp_path):
    (result,) = [one for one in published_results() if one.summary.policy == "stack"]
    summary = result.summary.model_copy(update={"policy": "a_module_of_somebody_else:AVeryLongNameOfAPolicy"})
    opened(tab, write_leaderboard(tmp_path, [result, result.model_copy(update={"summary": summary})]))
    assert tab.value("document.querySelectorAll('.board td.heat').length") == 16
    table = "document.querySelector('.board')"
    assert tab.value(f"{table}.scrollWidth <= {table}.parentElement.clientWidth")
    assert tab.value("document.querySelectorAll('#policies .policy').length") == 2


@pytest.mark.usefixtures("few_episodes")
def test_the_figure_ranks_learned_and_other_policies_together(tab, tmp_path):
    stack, astar = (one for one in published_results() if one.summary.policy in ("stack", "astar"))
    learned = astar.model_copy(update={"summary": astar.summary.model_copy(update={"policy": "local-ppo"})})
    opened(tab, write_leaderboard(tmp_path, [stack, astar, learned]))
    assert names_in(tab, "deployed") == ["stack", "astar", "local-ppo"]
    assert tab.value("document.querySelectorAll('.board [aria-sort]').length") == 0
    tab.value("document.querySelectorAll('.board thead button')[0].click()")
    assert names_in(tab, "deployed") == ["astar", "local-ppo", "stack"]
    tab.value("document.querySelectorAll('.board thead button')[1].click()")
    assert names_in(tab, "deployed")[0] == "stack"
    assert tab.value("document.querySelector('.board thead th:nth-child(2)').ariaSort") == "descending"


def test_the_skip_link_stays_in_the_view_and_links_move_the_focus(tab, page):
    opened(tab, page, "pairs")
    tab.value("document.querySelector('.skip').focus()")
    pressed(tab, "Enter")
    assert tab.value("document.activeElement.id") == "main"
    assert visible(tab) == ["pairs"]
    opened(tab, page, "policies")
    tab.value("document.querySelector('#policies .policy:not([hidden]) td.end a').focus()")
    pressed(tab, "Enter")
    tab.wait("!document.getElementById('episodes').hidden")
    assert tab.value("document.activeElement.id") == "main"
    assert tab.value("document.title").startswith("Episodes - ")
    tab.value("location.hash = 'endings'")
    tab.wait("!document.getElementById('about').hidden")
    assert 0 <= tab.value("document.getElementById('endings').getBoundingClientRect().top") < 860


def test_a_list_of_policies_keeps_the_focus_and_can_be_undone(tab, page):
    opened(tab, page, "p0")
    shown = "document.querySelector('#policies .policy:not([hidden])').id"
    first = tab.value(shown)
    tab.value("document.getElementById('which').focus()")
    pressed(tab, "ArrowDown")
    tab.wait(f"{shown} !== '{first}'")
    assert tab.value("document.activeElement.id") == "which"
    assert tab.value("location.hash.slice(1)") == tab.value(shown)
    tab.value("history.back()")
    tab.wait(f"{shown} === '{first}'")


def test_text_has_the_contrast_of_wcag_aa(tab, page):
    for width, scheme in ((1280, "light"), (390, "dark")):
        tab.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
        for view in VIEWS:
            opened(tab, page, view, width, width < 500)
            assert tab.value(FAINT) == [], (width, scheme, view)
    tab.call("Emulation.setEmulatedMedia", features=[])


def test_an_ending_leads_to_an_episode_that_ended_so(tab, page):
    opened(tab, page)
    tab.value("[...document.querySelectorAll('.board a')].find((one) => one.textContent === 'third').click()")
    tab.wait("!document.getElementById('policies').hidden")
    shown = "[...document.querySelectorAll('#policies .policy')].filter((one) => !one.hidden)"
    assert tab.value(f"{shown}.map((one) => one.querySelector('h3').textContent)") == ["third"]
    tab.value(f"{shown}[0].querySelector('td.end a').click()")
    tab.wait("!document.getElementById('episodes').hidden && document.querySelectorAll('#plan .driven').length === 1")
    words = tab.value("document.getElementById('runs').textContent")
    assert "contact with person 3" in words
    assert tab.errors == []


def test_a_task_shows_the_policies_that_drove_it_and_leads_to_them(tab, page):
    opened(tab, page, "t-people-2")
    rows = "[...document.querySelectorAll('#t-people-2 tbody tr')]"
    names = f"{rows}.map((one) => one.querySelector('a').textContent)"
    assert tab.value(names) == ["first", "second", "third"]
    tab.value("document.querySelectorAll('#t-people-2 thead button')[2].focus()")
    pressed(tab, "Enter")
    assert tab.value(names) == ["third", "first", "second"]  # the first two have the same mean and keep their order
    tab.value(f"{rows}[0].querySelector('a').focus()")
    pressed(tab, "Enter")
    tab.wait("!document.getElementById('policies').hidden")
    assert tab.value("document.activeElement.querySelector('h3').textContent") == "third"
    assert tab.errors == []


def test_people_and_robots_move_with_the_slider_and_the_play_button(tab, page):
    opened(tab, page, "episodes")
    bodies = "[...document.querySelectorAll('#plan g[transform] > .yields, #plan g[transform] > .unseeing')]"
    places = f"{bodies}.map((one) => one.parentNode.getAttribute('transform')).join()"
    robot = "document.querySelector('#plan .robot').getAttribute('transform')"
    tab.value("document.getElementById('clock').focus()")
    pressed(tab, "Home")
    first = tab.value(places), tab.value(robot)
    assert tab.value("document.getElementById('clock').getAttribute('aria-valuetext')").startswith("0.0 of ")
    pressed(tab, "End")
    last = tab.value(places), tab.value(robot)
    assert first[0] != last[0]
    assert first[1] != last[1]
    changed(tab, "speed", "16")
    tab.value("document.getElementById('play').click()")
    assert tab.value("document.getElementById('play').textContent") == "Pause"
    tab.wait("document.getElementById('play').textContent === 'Play'", seconds=30)
    assert tab.value("Number(document.getElementById('clock').value) === Number(document.getElementById('clock').max)")
    assert tab.value(robot) == last[1]
    assert tab.errors == []


def test_an_episode_replays_in_3d_where_its_route_leads(tab, page):
    opened(tab, page, "e0")
    canvas = "document.getElementById('space')"
    tab.wait(f"{canvas}.dataset.state === 'ready' && {canvas}.dataset.triangles > 10000", seconds=60)
    key, name = tab.value("[data.episodes[0].key, data.policies[document.getElementById('crowd').value]]")
    route = LabNavEvaluation.read(page.parent.parent / name).routes[key]
    pictures = []
    for time, pose in (("0", route[0]), ("1e6", route[-1])):
        before = tab.value(f"{canvas}.toDataURL()")
        changed(tab, "clock", time)
        x, y = pose[:2]
        near = f"Math.hypot(JSON.parse({canvas}.dataset.pose)[0] - {x}, JSON.parse({canvas}.dataset.pose)[1] - {y})"
        tab.wait(f"{near} < 0.01", seconds=30)
        pictures.append(tab.value(f"{canvas}.toDataURL()"))
        assert len(before) > 10_000
    assert pictures[0] != pictures[1]
    assert tab.value("document.getElementById('again').textContent").startswith(f"labgym record {page.parent.parent}")
    assert tab.errors == []


ROBOT_PIXELS = """(() => {
  const gl = stage.renderer.getContext(), {width, height} = stage.canvas;
  const [shown, without] = [true, false].map((visible) => {
    stage.robot.visible = visible;
    stage.renderer.render(stage.world, stage.camera);
    const pixels = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return pixels;
  });
  stage.robot.visible = true;
  return shown.filter((value, k) => k % 4 === 0 && value !== without[k]).length / (width * height);
})()"""
"""Share of the canvas that is different without the robot."""


def test_the_camera_that_follows_sees_the_robot_along_a_drive(tab, page):
    opened(tab, page, "e0")
    canvas = "document.getElementById('space')"
    tab.wait(f"{canvas}.dataset.state === 'ready'", seconds=60)
    end = tab.value("state.end")
    for share in (0.0, 0.3, 0.7, 1.0):
        changed(tab, "clock", str(share * end))
        tab.wait("stage.eye && stage.follow()", seconds=60)
        assert tab.value(ROBOT_PIXELS) > 0.005, share
    walls = "new Obstacles(stage.meshes, stage.bounds)"
    start = tab.value("stage.pose")
    assert tab.value(f"{walls}.between([{start[0]}, {start[1]}, 1.5], [-50, {start[1]}, 1.5])") is True
    assert tab.value(f"{walls}.between([{start[0]}, {start[1]}, 3.1], [{start[0]}, {start[1]}, 1.6])") is False
    assert tab.errors == []


def test_the_robot_of_carry_has_its_beaker(tab, tmp_path):
    part = published_episodes("carry", 2)
    suite = LabNavSuite("labnav-carry-2", (part.only({f"carry-2/{part.episodes[0].key}"}),))
    folder = write_folder(tmp_path / "run", suite, "one", "deployed", lambda _, __: 0.5, line_to_goal)
    report_labnav([folder], published=())
    opened(tab, folder / "report.html", "e0")
    tab.wait("document.getElementById('space').dataset.state === 'ready' && stage.payload.visible", seconds=60)
    assert tab.value("stage.payload.parent === stage.robot") is True
    assert tab.errors == []


def test_without_the_folder_of_replays_the_plan_stays_and_a_sentence_says_why(tab, page, tmp_path):
    alone = tmp_path / "alone.html"
    alone.write_bytes(page.read_bytes())
    opened(tab, alone, "e0")
    tab.wait("document.getElementById('space').dataset.state === 'failed'")
    assert "copy the folder replays/" in tab.value("document.getElementById('space-note').textContent")
    assert tab.value("document.querySelectorAll('#plan .goal').length") == 1
    assert any("ERR_FILE_NOT_FOUND" in str(error) for error in tab.errors)
    tab.errors.clear()


def test_routes_zoom_and_the_choice_of_episodes(tab, page):
    opened(tab, page, "episodes")
    assert tab.value("document.querySelectorAll('#plan .driven').length") == 3
    tab.value("document.querySelector('#runs input').click()")
    assert tab.value("document.querySelectorAll('#plan .driven').length") == 2
    whole = tab.value("document.getElementById('plan').getAttribute('viewBox')")
    tab.value("document.querySelector('[data-zoom=\"0.7\"]').click()")
    assert tab.value("document.getElementById('plan').getAttribute('viewBox')") != whole
    tab.value("document.querySelector('[data-zoom=\"0\"]').click()")
    assert tab.value("document.getElementById('plan').getAttribute('viewBox')") == whole
    changed(
        tab, "who", tab.value("[...document.getElementById('who').options].find((one) => one.text === 'second').value")
    )
    changed(tab, "how", "contact")
    assert tab.value("document.getElementById('episode').options.length") == 2
    before = tab.value("location.hash")
    tab.value("document.getElementById('next').click()")
    tab.wait(f"location.hash !== '{before}'")
    assert "Fume hood" in tab.value("document.getElementById('legend').textContent")
    assert tab.value("document.querySelectorAll('#equipment li').length") > 5
    assert tab.errors == []


def test_pairs_filter_by_policy(tab, page):
    opened(tab, page, "pairs")
    rows = "[...document.querySelectorAll('.pairs tbody tr')].filter((one) => !one.hidden).length"
    assert tab.value(rows) == 3
    changed(tab, "pair-of", tab.value("document.getElementById('pair-of').options[1].value"))
    assert tab.value(rows) == 2
    tab.value("document.getElementById('only-apart').click()")
    assert tab.value(rows) <= 2
    assert tab.errors == []


def test_controls_have_names_and_tables_have_headers(tab, page):
    opened(tab, page)
    unnamed = (
        "[...document.querySelectorAll('select, input, button')].filter((one) => "
        "!(one.labels && one.labels.length) && !one.ariaLabel && !one.textContent.trim()).map((one) => one.outerHTML)"
    )
    assert tab.value(unnamed) == []
    assert tab.value("[...document.querySelectorAll('th')].filter((one) => !one.scope).length") == 0
    assert tab.value("[...document.querySelectorAll('table')].filter((one) => !one.caption).length") == 0
    assert tab.value("document.querySelector('#plan').getAttribute('role')") == "img"
    tab.value("location.hash = 'episodes'")
    tab.wait("document.getElementById('plan-text').textContent.length > 20")
    assert "third: contact with person 3" in tab.value("document.getElementById('plan-text').textContent")
