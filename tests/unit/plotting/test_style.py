"""The labels of figures that are written."""

from __future__ import annotations

from friction_bayes.plotting.style import figure_files, new_figure, styled


def test_a_figure_shows_itself_where_pyplot_is_not_loaded() -> None:
    assert new_figure(1.0, 1.0)._repr_png_().startswith(b"\x89PNG")


def test_labels_and_the_power_that_they_share_are_text() -> None:
    with styled():
        figure = new_figure()
        axes = figure.subplots()
        axes.plot([0.0, 1.0], [0.0, 5e-4])
    figure_files(figure, ("png",))
    labels = [label.get_text() for label in axes.get_yticklabels()]
    assert {"0", "5"} <= set(labels)
    assert not any("$" in label for label in labels)
    assert axes.yaxis.get_offset_text().get_text() == "×10⁻⁴"
