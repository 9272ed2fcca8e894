//! The format of a response: the parameter `format`, or content negotiation.

use axum::http::HeaderMap;
use lookdown_detect::{
    parameter_table,
    parameters::{
        GivenParameters, Interface, ParameterDefault, ParameterError, ParameterKind, ParameterSpec,
    },
};
use strum::VariantNames;

use crate::{
    annotated_image::ImageFormat,
    annotation_formats::{AnnotationFormat, BoxKind},
    api::http::{
        accept::Accepted,
        problem::{Problem, ProblemKind},
    },
};

/// A format of a response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AnswerFormat {
    /// The report.
    Report,
    /// The annotated image.
    Image(ImageFormat),
    /// A file for annotation tools.
    Annotations(AnnotationFormat, BoxKind),
}

/// The names of the report and of the annotated image.
const REPORT: &str = "json";
const IMAGE: &str = "image";
const ANNOTATIONS: &[&str] = <AnnotationFormat as VariantNames>::VARIANTS;
const NAMES: [&str; 2 + ANNOTATIONS.len()] = {
    let mut names = [REPORT; 2 + ANNOTATIONS.len()];
    names[1] = IMAGE;
    let (_, annotations) = names.split_at_mut(2);
    annotations.copy_from_slice(ANNOTATIONS);
    names
};

parameter_table! {
    /// The parameter of the response format.
    pub(in crate::api) const TABLE;

    FORMAT = ParameterSpec {
        name: "format",
        kind: ParameterKind::Choice(&NAMES),
        default: ParameterDefault::Described(
            "the preference of the header `Accept` among JSON, JPEG, PNG and GeoJSON; otherwise `json`",
        ),
        help: "Format of the answer: the report (`json`), the annotated image (`image`: JPEG, or PNG if \
               `Accept` prefers it), or the persons in the format of an annotation tool, in pixels.",
        example: None,
        interfaces: &[Interface::Http],
    };
    ORIENTED = ParameterSpec {
        name: "oriented",
        kind: ParameterKind::Switch,
        default: ParameterDefault::Value("false"),
        help: "Boxes rotated along the persons as the shapes of an annotation file: for `cvat`, \
               `labelstudio` and `yolo` (YOLO OBB). `cepdof` and `geojson` always have them.",
        example: None,
        interfaces: &[Interface::Http],
    };
}

const GEOJSON: AnswerFormat =
    AnswerFormat::Annotations(AnnotationFormat::GeoJson, BoxKind::Oriented);

const IMAGES: [(AnswerFormat, &str); 2] =
    [for_image(ImageFormat::Jpeg), for_image(ImageFormat::Png)];
/// The formats that `Accept` can select. The media types of the other formats are not specific to
/// them.
const NEGOTIABLE: [(AnswerFormat, &str); 4] = [
    (AnswerFormat::Report, AnswerFormat::Report.media_type()),
    IMAGES[0],
    IMAGES[1],
    (GEOJSON, GEOJSON.media_type()),
];

const fn for_image(format: ImageFormat) -> (AnswerFormat, &'static str) {
    let format = AnswerFormat::Image(format);
    (format, format.media_type())
}

impl AnswerFormat {
    /// Reads the parameters; without `format`, chooses the format that `Accept` prefers. The
    /// parameter overrules `Accept`, which then only chooses between JPEG and PNG.
    pub(super) fn read<'a>(
        given: impl IntoIterator<Item = (&'a str, &'a str)>,
        headers: &HeaderMap,
    ) -> Result<Self, Problem> {
        let accepted = Accepted::from_headers(headers);
        let given = GivenParameters::read(TABLE, given)?;
        let boxes = if given.value(&ORIENTED)? {
            BoxKind::Oriented
        } else {
            BoxKind::AxisParallel
        };
        let format = match given.text(&FORMAT) {
            None => accepted.best_of(&NEGOTIABLE).ok_or_else(not_acceptable)?,
            Some(REPORT) => Self::Report,
            Some(IMAGE) => accepted.best_of(&IMAGES).unwrap_or(IMAGES[0].0),
            Some(name) => Self::Annotations(FORMAT.parse(name)?, boxes),
        };
        if boxes == BoxKind::Oriented && !format.has_oriented_boxes() {
            let formats = AnnotationFormat::names_with_oriented_boxes();
            let problem =
                format!("the format has no oriented boxes: use format with one of {formats}");
            return Err(ParameterError::bad_value(ORIENTED.name, problem).into());
        }
        Ok(format)
    }

    fn has_oriented_boxes(self) -> bool {
        matches!(self, Self::Annotations(format, _) if format.has_oriented_boxes())
    }

    /// Returns the media type of a response in this format.
    pub(super) const fn media_type(self) -> &'static str {
        match self {
            Self::Report => "application/json",
            Self::Image(ImageFormat::Jpeg) => "image/jpeg",
            Self::Image(ImageFormat::Png) => "image/png",
            Self::Annotations(format, _) => format.media_type(),
        }
    }
}

fn not_acceptable() -> Problem {
    let offered = NEGOTIABLE.map(|(_, media_type)| media_type).join(", ");
    let detail = format!(
        "Accept: none of its media types is available: use one of {offered}, omit the header, or set \
         the parameter format"
    );
    Problem::new(ProblemKind::NotAcceptable, detail)
}
