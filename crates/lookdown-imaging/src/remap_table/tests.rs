mod accuracy;
mod lenses;
mod sampling;
mod views;

use lookdown_lens::geometry::{ViewPlan, view_plan::Ring};

/// Views at the nadir, between it and the rim, and at the rim.
fn three_rings() -> ViewPlan {
    let ring = |elevation, count, degrees: f64| Ring {
        elevation,
        count,
        field_of_view: degrees.to_radians(),
    };
    ViewPlan::rings(&[ring(0.05, 2, 75.0), ring(0.8, 8, 90.0), ring(1.25, 8, 45.0)])
}
