//! Zones and masks drawn into a frame of their camera.

use super::{
    Mark,
    canvas::{Rgb, Stroke},
    label::Labels,
    line_width,
};
use crate::{
    geometry::{Lens, Mount, Pixel, Polygon, Zone},
    imaging::{Frame, MaskedPixels},
};

const ZONE: Rgb = [126, 240, 110];
const MASK: Rgb = [255, 128, 210];
/// Edges on the floor are curves in the frame.
const POINTS_PER_EDGE: u32 = 32;

/// Blanks what is under `masks` and outlines them, and draws `zones` with their names; all are in
/// pixels of the frame or on the floor seen through `lens`.
pub fn sketch_areas(
    frame: &mut Frame,
    zones: &[Zone],
    masks: &[Polygon],
    lens: &Lens,
    mount: &Mount,
) {
    MaskedPixels::new(masks, frame.width(), frame.height()).blank(frame);
    let width = line_width(frame);
    for mask in masks {
        for [from, to] in mask.edges() {
            Stroke::new(from.into(), to.into(), width).draw(frame, MASK, 1.0);
        }
    }
    let outlines: Vec<_> = zones
        .iter()
        .map(|zone| (zone, zone.outline(lens, mount, POINTS_PER_EDGE)))
        .collect();
    for (_, outline) in &outlines {
        for pair in outline.windows(2) {
            if let [Some(from), Some(to)] = *pair {
                Stroke::new(from.into(), to.into(), width).draw(frame, ZONE, 1.0);
            }
        }
    }
    let named: Vec<_> = outlines
        .iter()
        .filter_map(|(zone, outline)| mark(zone, outline.iter().flatten()))
        .collect();
    let coloured: Vec<_> = named.iter().map(|mark| (mark, ZONE)).collect();
    Labels::new(frame, &coloured, None).draw(frame);
}

/// The name of a zone at its bounding box; `None` when nothing of it is seen.
fn mark<'a>(zone: &Zone, outline: impl Iterator<Item = &'a Pixel>) -> Option<Mark> {
    let bbox = outline
        .map(|point| [point.x, point.y, point.x, point.y])
        .reduce(|a, b| {
            [
                a[0].min(b[0]),
                a[1].min(b[1]),
                a[2].max(b[2]),
                a[3].max(b[3]),
            ]
        })?;
    Some(Mark {
        bbox,
        oriented: None,
        head: None,
        label: zone.name.clone(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ZoneArea;

    #[test]
    fn masks_are_black_in_their_outline_and_zones_are_outlined_with_their_names() {
        let mut frame = Frame::new(200, 200, vec![90; 3 * 200 * 200]).unwrap();
        let lens = Lens::equidistant_circle(99.5, 99.5, 100.0, 1.5).unwrap();
        let square = |left: f64, right: f64| {
            let corners = [[left, left], [right, left], [right, right], [left, right]];
            Polygon::new(&corners).unwrap()
        };
        let mount = Mount::new(-nalgebra::Vector3::z_axis(), Some(3.0));
        let zones = [
            ("frame", ZoneArea::Frame(square(120.0, 150.0))),
            ("floor", ZoneArea::Floor(square(-1.0, 1.0))),
        ]
        .map(|(name, area)| Zone {
            name: name.to_owned(),
            area,
        });
        sketch_areas(&mut frame, &zones, &[square(10.0, 50.0)], &lens, &mount);
        assert_eq!(frame.pixel(30, 30), [0; 3]);
        assert_ne!(frame.pixel(10, 30), [0; 3]);
        assert_ne!(frame.pixel(120, 135), [90; 3]);
        // A metre to the left of the camera, 3 m below it, on an equidistant lens.
        let left = 100.0 - 100.0 / 1.5 * (1.0_f64 / 3.0).atan();
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a pixel"
        )]
        let left = left as u32;
        assert_ne!(frame.pixel(left, 100), [90; 3]);
        assert_eq!(frame.pixel(60, 150), [90; 3]);
    }
}
