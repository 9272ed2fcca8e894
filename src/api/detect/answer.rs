//! The response to a frame: the report as JSON, the annotated image, or a file for annotation
//! tools.

use axum::http::HeaderMap;
use bytes::Bytes;
use lookdown_detect::{
    parameter_table,
    parameters::{
        GivenParameters, Interface, ParameterDefault, ParameterError, ParameterKind, ParameterSpec,
    },
    pipeline::{DetectedFrame, PipelineError},
};
use strum::VariantNames;

use crate::{
    annotated_image::{AnnotationError, AnnotationOptions, ImageFormat, annotated_image},
    annotation_formats::{AnnotatedImage, AnnotationFormat, BoxKind},
    api::http::{
        accept::Accepted,
        problem::{Problem, ProblemKind},
        query::{pairs, take},
    },
};

/// The name of a frame that was sent without a file name.
const NAMELESS: &str = "frame";

/// The requested form of the response.
pub(in crate::api) struct AnswerOptions {
    format: AnswerFormat,
    image_options: AnnotationOptions,
    /// The file name of the frame as the client sent it.
    file_name: Option<String>,
}

/// The content of a response.
pub(in crate::api) struct Content {
    pub(in crate::api) media_type: &'static str,
    pub(in crate::api) bytes: Bytes,
}

impl AnswerOptions {
    /// Takes the parameters of the response out of those of a request.
    pub(in crate::api) fn take_from(
        given: &mut Vec<(String, String)>,
        headers: &HeaderMap,
        file_name: Option<String>,
    ) -> Result<Self, Problem> {
        let format = take(given, TABLE);
        let image_options = take(given, AnnotationOptions::TABLE);
        Ok(Self {
            format: AnswerFormat::read(pairs(&format), headers)?,
            image_options: AnnotationOptions::parse(pairs(&image_options))?,
            file_name,
        })
    }

    /// Returns the width of the annotated image, pixels; 0 for other formats.
    pub(in crate::api) fn drawn_width(&self) -> u32 {
        match self.format {
            AnswerFormat::Image(_) => self.image_options.width,
            AnswerFormat::Report | AnswerFormat::Annotations(..) => 0,
        }
    }

    /// Builds the response for a frame whose report is `json`. Drawing blocks: call it on a worker
    /// thread.
    pub(in crate::api) fn content(
        self,
        detected: DetectedFrame,
        json: &Bytes,
    ) -> Result<Content, Problem> {
        let report = &detected.report;
        let bytes = match self.format {
            AnswerFormat::Report => json.clone(),
            AnswerFormat::Image(format) => {
                let image = annotated_image(detected, format, &self.image_options);
                image.map_err(not_drawn)?.into()
            }
            AnswerFormat::Annotations(format, boxes) => {
                let name = self.file_name.unwrap_or_else(|| NAMELESS.to_owned());
                let image = AnnotatedImage::new(report, name);
                format.document(&image, boxes).into()
            }
        };
        Ok(Content {
            media_type: self.format.media_type(),
            bytes,
        })
    }
}

fn not_drawn(error: AnnotationError) -> Problem {
    match error {
        AnnotationError::Cancelled(_) => PipelineError::Withdrawn.into(),
        AnnotationError::Encode(error) => {
            Problem::new(ProblemKind::UnfitImage, format!("{error}: ask for a width"))
                .with_parameter("width")
        }
    }
}

/// A format of a response.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum AnswerFormat {
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
