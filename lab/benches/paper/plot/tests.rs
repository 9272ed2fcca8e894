use lookdown_imaging::decode::{DecodeLimits, decode};

use super::*;

fn plot(names: &[&str]) -> LinePlot {
    LinePlot {
        title: "two & more".to_owned(),
        x_name: "recall".to_owned(),
        y_name: "precision".to_owned(),
        lines: names
            .iter()
            .map(|name| Line {
                name: (*name).to_owned(),
                points: vec![[0.0, 1.0], [0.5, 1.0], [0.5, 0.2]],
                dashed: vec![[0.0, 0.8], [0.2, 0.8]],
                marked: false,
            })
            .collect(),
    }
}

#[test]
fn an_svg_names_its_lines_axes_and_title_in_well_formed_text() {
    let svg = plot(&["paper <nms>", "direct"]).svg().unwrap();
    for text in [
        "paper &lt;nms&gt;",
        "direct",
        "recall",
        "precision",
        "two &amp; more",
    ] {
        assert!(svg.contains(text), "{text} is missing");
    }
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
}

#[test]
fn a_png_shows_each_line_in_its_own_color() {
    let png = plot(&["a", "b"]).png().unwrap();
    let frame = decode(&png, &DecodeLimits::default()).unwrap().frame;
    let has = |color: [u8; 3]| frame.pixels().chunks_exact(3).any(|pixel| pixel == color);
    // The second covers the first, except in the legend.
    assert!(has([0, 114, 178]) && has([213, 94, 0]));
}

#[test]
fn only_plots_of_too_many_lines_are_refused() {
    assert!(plot(&[]).svg().is_ok());
    assert!(plot(&["line"; MAX_LINES]).svg().is_ok());
    let refused = plot(&["line"; MAX_LINES + 1])
        .png()
        .unwrap_err()
        .to_string();
    assert!(refused.contains("65 lines"), "{refused}");
}
