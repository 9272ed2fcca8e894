//! The mark of a person in the frame.

use lookdown_detect::pipeline::Person;
use lookdown_imaging::annotate::{Head, Mark, OrientedMark};
use lookdown_lens::geometry::OrientedBox;

/// The person's mark, with the score on its label.
pub(super) fn mark(person: &Person) -> Mark {
    let oriented = &person.oriented_box;
    Mark {
        bbox: person.bbox.corners(),
        oriented: Some(OrientedMark {
            cx: oriented.center.x,
            cy: oriented.center.y,
            width: oriented.width,
            height: oriented.height,
            angle_deg: oriented.angle.to_degrees(),
        }),
        head: Some(head(oriented)),
        label: format!("{:.2}", person.score),
    }
}

/// The circle that touches the upper short side and both long sides of the box.
fn head(oriented: &OrientedBox) -> Head {
    let radius = oriented.width.min(oriented.height) / 2.0;
    let center = oriented.center + oriented.up * (oriented.height / 2.0 - radius);
    Head {
        cx: center.x,
        cy: center.y,
        radius,
    }
}
