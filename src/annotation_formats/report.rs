//! Converts a report to an annotated image.

use lookdown_detect::pipeline::{DetectionReport, Person};

use super::{AnnotatedBox, AnnotatedImage};

impl AnnotatedImage {
    /// Returns the persons of a report as annotations of the image with this file name.
    #[must_use]
    pub fn new(report: &DetectionReport, file_name: String) -> Self {
        let calibration = &report.calibration;
        Self {
            file_name,
            width: report.image_width,
            height: report.image_height,
            calibration: calibration
                .assumed_circle
                .is_none()
                .then(|| calibration.id.clone()),
            persons: report.persons.iter().map(AnnotatedBox::from).collect(),
        }
    }
}

impl From<&Person> for AnnotatedBox {
    fn from(person: &Person) -> Self {
        Self {
            bbox: person.bbox,
            oriented_box: person.oriented_box,
            score: person.score,
            floor: person.floor,
        }
    }
}
