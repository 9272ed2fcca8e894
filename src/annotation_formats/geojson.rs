//! GeoJSON (RFC 7946): a feature collection per image. The geometry of a person is its oriented
//! box. Positions are corner-origin frame pixels, x to the right and y down, as image tools read
//! them, not longitude and latitude. RFC 7946 permits this by prior agreement (section 4). The
//! person's position on the floor, in meters, is a property.

use lookdown_common::report::ReportFloor;
use serde::Serialize;

use super::{
    AnnotatedBox, AnnotatedImage, BoxKind, FormatSpec, LABEL, Layout, SupportedBoxes,
    content::ImageMembers, stem,
};
use crate::rounding::{degrees, floor, pixels, share};

#[derive(Serialize)]
struct FeatureCollection<'a> {
    r#type: &'static str,
    /// An addition to the members of GeoJSON: the image to which positions refer.
    image: ImageMembers<'a>,
    features: Vec<Feature>,
}

#[derive(Serialize)]
struct Feature {
    r#type: &'static str,
    id: usize,
    geometry: Polygon,
    properties: Properties,
}

#[derive(Serialize)]
struct Polygon {
    r#type: &'static str,
    coordinates: [[[f64; 2]; 5]; 1],
}

#[derive(Serialize)]
struct Properties {
    label: &'static str,
    score: f64,
    /// Axis-parallel: left, top, right, bottom.
    r#box: [f64; 4],
    angle_deg: f64,
    foot: [f64; 2],
    floor: Option<ReportFloor>,
}

/// The format.
pub(super) const FORMAT: FormatSpec = FormatSpec {
    media_type: "application/geo+json",
    boxes: SupportedBoxes::Oriented,
    layout: Layout::FilePerImage {
        path,
        document,
        others: Vec::new,
    },
};

/// The path of an image's file.
fn path(image_file_name: &str) -> String {
    format!("features/{}.geojson", stem(image_file_name))
}

fn document(image: &AnnotatedImage, _boxes: BoxKind) -> String {
    let features = image.boxes().zip(1..);
    let document = FeatureCollection {
        r#type: "FeatureCollection",
        image: image.members(),
        features: features
            .map(|((corners, person), id)| feature(id, corners, person))
            .collect(),
    };
    // Serializing numbers and strings in a fixed structure cannot fail.
    serde_json::to_string_pretty(&document).unwrap_or_default()
}

fn feature(id: usize, corners: [f64; 4], person: &AnnotatedBox) -> Feature {
    let oriented = &person.oriented_box;
    let foot = oriented.foot();
    Feature {
        r#type: "Feature",
        id,
        geometry: Polygon {
            r#type: "Polygon",
            coordinates: [ring(person)],
        },
        properties: Properties {
            label: LABEL,
            score: share(person.score),
            r#box: corners,
            angle_deg: degrees(oriented.angle),
            foot: [pixels(foot.x), pixels(foot.y)],
            floor: person.floor.map(floor),
        },
    }
}

/// The corners, with the first repeated at the end. They are counterclockwise with y upward, as RFC
/// 7946 requires (section 3.1.6), and therefore clockwise in the image.
fn ring(person: &AnnotatedBox) -> [[f64; 2]; 5] {
    let [a, b, c, d] = person
        .oriented_box
        .corners()
        .map(|corner| [pixels(corner.x), pixels(corner.y)]);
    [a, b, c, d, a]
}
