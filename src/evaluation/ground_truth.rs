//! What is to be compared: the truth of an image, and what was found in it.

/// The persons of one image, by hand or by construction.
#[derive(Debug, Clone, PartialEq)]
pub struct GroundTruth<B> {
    /// Persons, to be found or to be passed over.
    pub persons: Vec<AnnotatedPerson<B>>,
    /// Regions in which a detection is neither right nor wrong (`iscrowd` in COCO files).
    pub ignore_regions: Vec<B>,
}

/// A person of the truth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AnnotatedPerson<B> {
    /// Where.
    pub outline: B,
    /// Whether the person is to be found. Missing one that is not is no fault, and finding one
    /// is no merit (`difficult` in VOC files).
    pub counts: bool,
    /// The share of the person that can be seen, 0 to 1, where the annotations say so.
    pub visible_fraction: Option<f64>,
}

impl<B> From<B> for AnnotatedPerson<B> {
    /// A person to be found, of whom nothing else is known.
    fn from(outline: B) -> Self {
        Self {
            outline,
            counts: true,
            visible_fraction: None,
        }
    }
}

impl<B> GroundTruth<B> {
    /// How many persons are to be found.
    #[must_use]
    pub fn person_count(&self) -> usize {
        self.persons.iter().filter(|person| person.counts).count()
    }
}

impl<B> Default for GroundTruth<B> {
    /// Nobody.
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
    /// Where.
    pub bbox: B,
    /// Confidence, finite.
    pub score: f64,
}

/// One image's truth and detections.
#[derive(Debug, Clone, PartialEq)]
pub struct EvaluatedImage<B> {
    /// What is in it.
    pub truth: GroundTruth<B>,
    /// What was found, in any order; of equal scores the earlier goes first.
    pub detections: Vec<ScoredBox<B>>,
}
