//! The cost of a frame: the permits of `limits.max_frames_in_flight` that it takes.
//!
//! A frame of a usual size costs 1. Each 8 megapixels that are decoded, each 32 inputs of the
//! network, and each 8 megapixels that are drawn add 1. A frame with more pixels than the limit
//! also costs 1, because its header is enough to refuse it. No frame costs more than a client may
//! use.

use super::DetectJob;

/// Pixels, decoded or drawn, that add 1. With the default limits, two of the largest frames are
/// decoded side by side, which keeps the memory below 2 GiB.
const PIXELS_PER_PERMIT: u64 = 8_000_000;
/// Inputs of the network that add 1.
const INPUTS_PER_PERMIT: usize = 32;

/// Returns the cost of a frame by the size in its header, its profile and its drawing. A frame of
/// more than `max_pixels` will be refused.
pub(super) fn for_frame(job: &DetectJob, max_pixels: u64) -> usize {
    let size = job.image.size().unwrap_or((0, 0));
    if u64::from(size.0) * u64::from(size.1) > max_pixels {
        return 1;
    }
    let profile = job.parameters.profile;
    let plan = profile.view_plan();
    let first_pass = plan.map_or(1, |plan| plan.directions.len());
    let inputs = first_pass + profile.max_crop_inputs();
    cost(size, job.ticket.drawn_width, inputs)
}

fn cost((width, height): (u32, u32), drawn_width: u32, inputs: usize) -> usize {
    let area = |width: u32, height: u64| u64::from(width) * height;
    let decoded = area(width, height.into());
    let drawn_width = drawn_width.min(width);
    let drawn_height = u64::from(height) * u64::from(drawn_width) / u64::from(width.max(1));
    let drawn = area(drawn_width, drawn_height);
    let permits = decoded / PIXELS_PER_PERMIT + drawn / PIXELS_PER_PERMIT;
    let permits = usize::try_from(permits).unwrap_or(usize::MAX);
    permits.saturating_add(1 + inputs / INPUTS_PER_PERMIT)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pipeline::test_support::{frame_with_disc, job};

    #[test]
    fn usual_frames_cost_one_permit_and_larger_ones_more() {
        assert_eq!(cost((2048, 2048), 2048, 24), 1);
        assert_eq!(cost((8192, 6100), 0, 24), 7);
        assert_eq!(cost((8192, 6100), 8192, 24), 13);
        assert_eq!(cost((8192, 6100), 2048, 24), 7);
        assert_eq!(cost((8192, 6100), 8192, 128), 17);
    }

    #[test]
    fn a_frame_that_will_be_refused_costs_one_permit() {
        let image = frame_with_disc(100, [30.0, 50.0], 8.0);
        let job = job(image, &[("profile", "paper")]);
        assert_eq!(for_frame(&job, 9_999), 1);
        assert_eq!(for_frame(&job, 10_000), 5);
    }

    #[test]
    fn the_profile_counts_by_its_inputs_of_the_network() {
        for (profile, expected) in [
            ("direct", 1),
            ("fast", 1),
            ("balanced", 1),
            ("quality", 2),
            ("paper", 5),
        ] {
            let image = frame_with_disc(100, [30.0, 50.0], 8.0);
            assert_eq!(
                for_frame(&job(image, &[("profile", profile)]), u64::MAX),
                expected,
                "{profile}"
            );
        }
    }
}
