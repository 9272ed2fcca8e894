//! GeoJSON (RFC 7946): a feature collection per image. The geometry of a person is its oriented
//! box. Positions are corner-origin frame pixels, x to the right and y down, as image tools read
//! them, not longitude and latitude. RFC 7946 permits this by prior agreement (section 4). The
//! person's position on the floor, in meters, is a property, and so is the axis-parallel `box`:
//! left, top, right, bottom. The member `image` is an addition to those of GeoJSON.

use serde_json::{Value, json};

use super::content::{
    AnnotatedBox, AnnotatedImage, FormatSpec, LABEL, Layout, SupportedBoxes, json_text, stem,
};
use crate::rounding::{degrees, floor, pixels, share};

/// The format.
pub(super) const FORMAT: FormatSpec = FormatSpec {
    media_type: "application/geo+json",
    boxes: SupportedBoxes::Oriented,
    layout: Layout::FilePerImage {
        path: |image_file_name| format!("features/{}.geojson", stem(image_file_name)),
        document: |image, _| document(image),
        others: |_| Vec::new(),
    },
};

fn document(image: &AnnotatedImage) -> String {
    let features = image.boxes().zip(1..);
    let features = features.map(|((corners, person), id)| feature(id, corners, person));
    json_text(&json!({
        "type": "FeatureCollection",
        "image": image.members(),
        "features": features.collect::<Vec<_>>(),
    }))
}

/// Returns a person as a feature. Its ring repeats the first corner at the end. The corners are
/// counterclockwise with y upward, as RFC 7946 requires (section 3.1.6), and therefore clockwise in
/// the image.
fn feature(id: usize, corners: [f64; 4], person: &AnnotatedBox) -> Value {
    let oriented = &person.oriented_box;
    let foot = oriented.foot();
    let ring = oriented.corners().map(|at| [pixels(at.x), pixels(at.y)]);
    let [a, b, c, d] = ring;
    json!({
        "type": "Feature",
        "id": id,
        "geometry": {"type": "Polygon", "coordinates": [[a, b, c, d, a]]},
        "properties": {
            "label": LABEL,
            "score": share(person.score),
            "box": corners,
            "angle_deg": degrees(oriented.angle),
            "foot": [pixels(foot.x), pixels(foot.y)],
            "floor": person.floor.map(floor),
        },
    })
}
