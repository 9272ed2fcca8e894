//! Average precision, by three common definitions.

use super::PrecisionRecallCurve;

/// The average precision of one curve. In all three definitions the precision at a recall is the
/// maximum at that recall or a higher one (the envelope).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AveragePrecision {
    /// Area under the envelope: PASCAL VOC from 2010 on.
    pub all_point_area: f64,
    /// Mean at recall 0, 0.1 … 1: PASCAL VOC until 2009 (Everingham et al., IJCV 2010, eq. 1).
    pub eleven_point: f64,
    /// Mean at recall 0, 0.01 … 1: COCO.
    pub coco_101_point: f64,
}

impl PrecisionRecallCurve {
    /// The average precision of this curve, 0 to 1.
    pub fn average_precision(&self) -> AveragePrecision {
        let envelope = self.envelope();
        AveragePrecision {
            all_point_area: area(&envelope),
            eleven_point: mean_at(&envelope, (0..=10_u8).map(|level| f64::from(level) / 10.0)),
            // A product, not a quotient: it equals the levels of `pycocotools` to the last bit.
            coco_101_point: mean_at(&envelope, (0..=100_u8).map(|level| f64::from(level) * 0.01)),
        }
    }

    /// `(recall, envelope precision)` of each point, by ascending recall.
    pub fn envelope(&self) -> Vec<(f64, f64)> {
        let mut greatest: f64 = 0.0;
        let mut envelope: Vec<(f64, f64)> = self
            .points
            .iter()
            .rev()
            .map(|point| {
                greatest = greatest.max(point.precision);
                (point.recall, greatest)
            })
            .collect();
        envelope.reverse();
        envelope
    }
}

fn area(envelope: &[(f64, f64)]) -> f64 {
    let mut previous_recall = 0.0;
    let mut area = 0.0;
    for (recall, precision) in envelope {
        area += (recall - previous_recall) * precision;
        previous_recall = *recall;
    }
    area
}

/// The mean envelope precision at recall levels. It is 0 at levels that are not reached.
fn mean_at(envelope: &[(f64, f64)], levels: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = super::precision_recall::count(levels.len());
    let sum: f64 = levels
        .map(|level| {
            let reached = envelope.partition_point(|(recall, _)| *recall < level);
            envelope
                .get(reached)
                .map_or(0.0, |(_, precision)| *precision)
        })
        .sum();
    sum / count
}
