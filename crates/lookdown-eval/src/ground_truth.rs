//! The inputs of a comparison: the ground truth of an image, and its detections.

/// The annotated or synthetic persons of one image.
#[derive(Debug, Clone, PartialEq)]
pub struct GroundTruth<B> {
    /// Persons, those that count and those that do not.
    pub persons: Vec<AnnotatedPerson<B>>,
    /// Regions in which a detection is neither right nor wrong (`iscrowd` in COCO files).
    pub ignore_regions: Vec<B>,
}

/// A person of the ground truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnnotatedPerson<B> {
    /// The outline.
    pub outline: B,
    /// True if the person counts. Otherwise a miss is not an error, and a detection is neither
    /// right nor wrong (`difficult` in VOC files).
    pub counts: bool,
    /// The visible fraction of the person, 0 to 1, if the annotations state it.
    pub visible_fraction: Option<f64>,
}

impl<B> From<B> for AnnotatedPerson<B> {
    /// A person that counts, without further properties.
    fn from(outline: B) -> Self {
        Self {
            outline,
            counts: true,
            visible_fraction: None,
        }
    }
}

impl<B> GroundTruth<B> {
    /// The number of persons that count.
    pub fn person_count(&self) -> usize {
        self.persons.iter().filter(|person| person.counts).count()
    }
}

impl<B> Default for GroundTruth<B> {
    /// Creates a ground truth without persons.
    fn default() -> Self {
        Self {
            persons: Vec::new(),
            ignore_regions: Vec::new(),
        }
    }
}

/// A detection with its confidence.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ScoredBox<B> {
    /// The outline.
    pub bbox: B,
    /// Confidence, finite.
    pub score: f64,
}

/// The ground truth and the detections of one image.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluatedImage<B> {
    /// The ground truth.
    pub truth: GroundTruth<B>,
    /// The detections, in any order. Of equal scores the earlier one is matched first.
    pub detections: Vec<ScoredBox<B>>,
}
