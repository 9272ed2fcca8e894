//! Reasons to return no camera.

/// The edges do not determine the camera.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error, strum::IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum FitRefusal {
    /// A blank or dark room.
    #[error(
        "the frame has {edges} edges, too few for a fit: give another frame with the lights on, or with more of the \
         room"
    )]
    TooFewEdges {
        /// Number of edges.
        edges: usize,
    },
    /// Known values that no lens of the method has.
    #[error(
        "no lens of the known model has such a field of view, as an orthographic one that sees 180°: correct the model or \
         the field of view, or leave one of them out"
    )]
    NoSuchLens,
    /// A room without a rectangular order.
    #[error(
        "only {:.0} % of the edges follow three orthogonal directions: give a frame that shows more walls, doors or \
         shelves", 100.0 * explained
    )]
    NoDirections {
        /// Explained share of the edges.
        explained: f64,
    },
    /// Walls without vertical edges, or edges in one horizontal direction only.
    #[error(
        "one of the three directions of the room has no edges: give a frame that shows walls with doors or corners"
    )]
    MissingDirection,
    /// A camera on a wall that looks horizontally, or down into the room.
    #[error(
        "two directions of the room may be the vertical, as for a camera that looks horizontally from a wall: say that it \
         is on a ceiling if it is, and calibrate cameras on walls with a chessboard"
    )]
    VerticalUnclear,
    /// A known model or field of view that the edges contradict.
    #[error(
        "the edges contradict the known values of the lens: with other values its circle has {field_of_view_deg:.0}° and \
         explains them clearly better: check the data sheet, or leave the values out"
    )]
    Contradicted {
        /// Field of view of the better lens, degrees.
        field_of_view_deg: f64,
        /// Explained share of the edges.
        explained: f64,
    },
    /// A frame of another camera, or from before the camera was moved.
    #[error(
        "frame {frame} is not like the others, only {:.0} % of its edges follow their camera: leave it out if it is of \
         another camera, or the camera was moved", 100.0 * explained
    )]
    FrameDisagrees {
        /// The number of the frame, from 1.
        frame: usize,
        /// Explained share of its edges.
        explained: f64,
    },
    /// Two cameras explain the edges equally well.
    #[error(
        "two different cameras explain the edges equally well: give the model of the lens if it is missing (a camera \
         that looks straight down often needs it), or further frames"
    )]
    Ambiguous {
        /// Explained share of the edges.
        explained: f64,
    },
    /// The evidence is flat.
    #[error(
        "the edges determine the lens to {radius_percent:.1} % and the level to {level_deg:.1}° only: give the model of \
         the lens if it is missing, or further frames"
    )]
    Uncertain {
        /// Standard deviation of the radius, percent.
        radius_percent: f64,
        /// Standard deviation of the level, degrees.
        level_deg: f64,
        /// Explained share of the edges.
        explained: f64,
    },
    /// Half of the edges gives another camera.
    #[error(
        "halves of the edges disagree by {radius_percent:.1} % of the radius and {level_deg:.1}°: give further frames \
         with more of the room"
    )]
    HalvesDisagree {
        /// Difference of the radius, percent.
        radius_percent: f64,
        /// Difference of the level, degrees.
        level_deg: f64,
        /// Explained share of the edges.
        explained: f64,
    },
}

impl FitRefusal {
    /// Returns the share of the edges along three directions, or `None` if another reason came
    /// first.
    pub fn explained(&self) -> Option<f64> {
        match self {
            Self::NoDirections { explained }
            | Self::Ambiguous { explained }
            | Self::Contradicted { explained, .. }
            | Self::Uncertain { explained, .. }
            | Self::HalvesDisagree { explained, .. } => Some(*explained),
            Self::NoSuchLens
            | Self::FrameDisagrees { .. }
            | Self::TooFewEdges { .. }
            | Self::MissingDirection
            | Self::VerticalUnclear => None,
        }
    }

    /// Returns the name of the reason, for programs: the variant in snake case.
    pub fn reason(&self) -> &'static str {
        self.into()
    }
}
