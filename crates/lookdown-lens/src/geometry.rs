//! Pure camera geometry in `f64`: lens models, mounts, virtual views, view plans and box
//! footprints. Knows no image, does no I/O.
//!
//! * Camera frame: OpenCV (x right, y down, z along the optical axis).
//! * Lens functions speak of pixel centers: the center of the top-left pixel is (0, 0).
//! * Boxes are corner-origin: pixel `i` covers `[i, i + 1)`. [`pixels`] crosses the half pixel.
//! * Angles are radians; `theta` is the angle from the optical axis.

pub mod counting_line;
pub mod crop_placement;
pub mod floor;
pub mod foot_filter;
pub mod footprint;
pub mod frame_crop;
pub mod height_ratio;
pub mod hull;
pub mod lens;
pub mod mount;
pub mod oriented_box;
pub mod panorama;
pub mod person_height;
pub mod pixels;
pub mod polygon;
pub mod posture;
#[cfg(test)]
pub(crate) mod test_people;
pub mod view_plan;
pub mod virtual_view;
pub mod zone;

pub use counting_line::{CountingLine, LineEnds};
pub use foot_filter::{FootFilter, FootPlace};
pub use footprint::{BackProjection, Footprint};
pub use frame_crop::{FrameCrop, QuarterTurn};
pub use lens::{Lens, LensError};
pub use mount::{Mount, SitePlacement};
pub use oriented_box::OrientedBox;
pub use panorama::Panorama;
pub use person_height::PersonHeight;
pub use polygon::{Polygon, PolygonError};
pub use posture::{BoxAngles, FloorVotes, Posture, PostureBelief, PostureSigns};
pub use view_plan::{FieldOfViewReading, ViewPlan};
pub use virtual_view::VirtualView;
pub use zone::{Zone, ZoneArea};

/// A position in an image, in pixels.
pub type Pixel = nalgebra::Point2<f64>;
/// A direction in the camera frame; of unit length unless said otherwise.
pub type Ray = nalgebra::Vector3<f64>;
