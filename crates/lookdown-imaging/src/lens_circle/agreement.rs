//! One circle for several frames of the same camera.

use super::LensCircle;

/// Common lens circle of several frames of one camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AgreedCircle {
    /// The median of the frames' circles, coordinate by coordinate. A single frame that is too dark
    /// or too crowded does not change it.
    pub circle: LensCircle,
    /// Number of frames whose center and radius lie within half a percent of the radius from it.
    pub agreeing: usize,
    /// The greatest distance of an agreeing frame's center or radius from it, in pixels.
    pub spread: f64,
}

/// Returns the circle on which most frames agree, or `None` without any frame.
pub fn agreed_circle(circles: &[LensCircle]) -> Option<AgreedCircle> {
    let median = |coordinate: fn(&LensCircle) -> f64| {
        let mut values: Vec<f64> = circles.iter().map(coordinate).collect();
        values.sort_by(f64::total_cmp);
        let middle = values.len() / 2;
        let upper = values.get(middle)?;
        // For an even number, the mean of the two middle values.
        let lower = values[values.len().saturating_sub(1) / 2];
        Some(f64::midpoint(lower, *upper))
    };
    let circle = LensCircle {
        cx: median(|circle| circle.cx)?,
        cy: median(|circle| circle.cy)?,
        radius: median(|circle| circle.radius)?,
    };
    let distance = |other: &LensCircle| {
        let apart = (other.cx - circle.cx).hypot(other.cy - circle.cy);
        apart.max((other.radius - circle.radius).abs())
    };
    let near = circles.iter().map(distance);
    let near: Vec<f64> = near.filter(|apart| *apart <= circle.tolerance()).collect();
    Some(AgreedCircle {
        circle,
        agreeing: near.len(),
        spread: near.into_iter().fold(0.0, f64::max),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn circle(cx: f64, cy: f64, radius: f64) -> LensCircle {
        LensCircle { cx, cy, radius }
    }

    #[test]
    fn without_a_circle_there_is_none_to_agree_on() {
        assert_eq!(agreed_circle(&[]), None);
    }

    #[test]
    fn a_single_frame_agrees_with_itself() {
        let only = circle(300.0, 301.0, 290.0);
        let agreed = agreed_circle(&[only]).unwrap();
        assert_eq!(agreed.circle, only);
        assert_eq!((agreed.agreeing, agreed.spread), (1, 0.0));
    }

    #[test]
    fn a_frame_that_is_wrong_does_not_move_the_circle() {
        let frames = [
            circle(300.0, 300.0, 290.0),
            circle(300.4, 300.0, 290.0),
            circle(310.0, 250.0, 120.0),
        ];
        let agreed = agreed_circle(&frames).unwrap();
        assert_eq!(agreed.circle, circle(300.4, 300.0, 290.0));
        assert_eq!(agreed.agreeing, 2);
        assert!((agreed.spread - 0.4).abs() < 1e-9);
    }

    #[test]
    fn two_frames_meet_in_the_middle() {
        let agreed = agreed_circle(&[circle(299.0, 300.0, 290.0), circle(300.0, 300.0, 291.0)]);
        assert_eq!(agreed.unwrap().circle, circle(299.5, 300.0, 290.5));
    }
}
