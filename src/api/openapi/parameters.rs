//! The request parameters as they are described. `pipeline::DetectParameters` and `api::answer` read
//! and check them; a test holds them together. Defaults are told in words: clients that are generated
//! would send them, in the query and in the form, and what is given twice is refused.

use utoipa::{
    IntoParams, PartialSchema, ToSchema,
    openapi::{
        KnownFormat, Object, ObjectBuilder, RefOr, Schema, SchemaFormat,
        schema::{AdditionalProperties, Type},
    },
};

/// Parameters in the query, beside those of pictures.
#[derive(IntoParams)]
#[into_params(parameter_in = Query)]
#[expect(dead_code, reason = "describes what pipeline::DetectParameters reads")]
pub(in crate::api) struct DetectQuery {
    /// The calibration's ID. Without it an ideal lens is assumed.
    #[param(example = "lobby", pattern = "^[a-z0-9][a-z0-9_-]{0,63}$")]
    calibration: Option<String>,
    /// The name under which results are kept; the calibration's ID by default.
    #[param(example = "lobby-north", max_length = 128)]
    camera: Option<String>,
    /// How thoroughly to look: `balanced` by default; `paper` is the published method with its 128
    /// views, `direct` runs the detector on the frame itself.
    #[param(inline)]
    profile: Option<ProfileName>,
    /// How overlapping boxes become persons; `fusion` by default, in `paper` `soft_nms_gaussian`,
    /// in `direct` `nms`.
    #[param(inline)]
    refine: Option<RefinementName>,
    /// Look with this model; the profile's by default.
    #[param(example = "ssdlite_mobilenet_v2")]
    model: Option<String>,
    /// Leave out persons with a lower score (`C_t`); 0.3 by default.
    #[param(minimum = 0, maximum = 1)]
    score_threshold: Option<f64>,
    /// Boxes that overlap at least this much are the same person (`N_t`); 0.5 by default.
    #[param(minimum = 0, maximum = 1)]
    iou_threshold: Option<f64>,
    /// σ of `soft_nms_gaussian`; 0.3 by default.
    #[param(exclusive_minimum = 0)]
    sigma: Option<f64>,
    /// Most persons in the report, best first; 1000 by default.
    #[param(minimum = 1, maximum = 10000)]
    max_detections: Option<u32>,
    /// When the frame was taken.
    #[param(value_type = Option<String>, format = DateTime, example = "2026-11-21T09:30:00Z")]
    captured_at: Option<String>,
    /// Do not look again at views in which nothing has moved since the last frame of this camera
    /// that this server saw; the report counts them. Needs `camera` or `calibration`.
    motion: Option<bool>,
    /// Remember what is found in the views of this frame; and if the same file was sent before with
    /// this, do not look again: another refinement or threshold needs no new inference. The report
    /// counts all its views as unchanged then.
    remember: Option<bool>,
    /// Whose turn comes first when frames wait: 1 before 9, 5 by default. Frames of one priority are served in
    /// the order of their arrival.
    #[param(minimum = 1, maximum = 9)]
    priority: Option<u32>,
    /// How long the report is of use, counted from the arrival of the request: a frame that has
    /// none by then is given up and answered 504. The server's own limit holds, too.
    #[param(minimum = 1, maximum = 600_000, example = 2000)]
    timeout_millis: Option<u32>,
    /// What the answer is: the report (`json`), the frame with boxes drawn into it (`image`: JPEG, or
    /// PNG if `Accept` prefers it), or the persons as a file of COCO, CVAT, YOLO, Pascal VOC or as
    /// GeoJSON, in pixels. By default what `Accept` prefers of JSON, JPEG, PNG and GeoJSON.
    #[param(inline)]
    format: Option<FormatName>,
}

/// How a picture is drawn, in the query.
#[derive(IntoParams)]
#[into_params(parameter_in = Query)]
#[expect(
    dead_code,
    reason = "describes what annotated_picture::PictureOptions reads"
)]
pub(in crate::api) struct PictureQuery {
    /// What is drawn into a picture: some of `boxes`, `oriented`, `scores`, `zones`, `views` and `timestamp`, with
    /// commas, or `none`; `oriented,scores` by default.
    #[param(
        pattern = "^(none|(boxes|oriented|scores|zones|views|timestamp)(,(boxes|oriented|scores|zones|views|timestamp))*)$"
    )]
    draw: Option<String>,
    /// Width of a picture, pixels; a frame that is no wider stays as it is. 2048 by default.
    #[param(minimum = 64, maximum = 8192, example = 640)]
    width: Option<u32>,
    /// Quality of a JPEG; 88 by default.
    #[param(minimum = 1, maximum = 100)]
    quality: Option<u8>,
}

/// The frame and parameters in a form: what `upload::form` reads.
pub(in crate::api) struct DetectForm;

impl ToSchema for DetectForm {
    fn schemas(_: &mut Vec<(String, RefOr<Schema>)>) {}
}

impl PartialSchema for DetectForm {
    /// The parameters of the query and the frame, and no other field.
    fn schema() -> RefOr<Schema> {
        let frame = "The frame: a JPEG, PNG or WebP file. `image` is accepted as another name of this field.";
        let frame = binary()
            .content_media_type("application/octet-stream")
            .description(Some(frame));
        let form = ObjectBuilder::new()
            .description(Some("The frame, and any parameter of the query."))
            .property("img", frame)
            .required("img")
            .additional_properties(Some(AdditionalProperties::<Schema>::FreeForm(false)));
        let form = fields().fold(form, |form, (name, field)| form.property(name, field));
        form.into()
    }
}

/// The parameters of `/detect` as fields of an object.
pub(in crate::api) fn fields() -> impl Iterator<Item = (String, Object)> {
    let parameters = DetectQuery::into_params(|| None).into_iter();
    let parameters = parameters.chain(PictureQuery::into_params(|| None));
    parameters.filter_map(|parameter| {
        let Some(RefOr::T(Schema::Object(mut field))) = parameter.schema else {
            return None;
        };
        field.description = parameter.description;
        Some((parameter.name, field))
    })
}

/// Bytes as they are, in a body of their own.
pub(in crate::api) struct RawBytes;

impl ToSchema for RawBytes {
    fn schemas(_: &mut Vec<(String, RefOr<Schema>)>) {}
}

impl PartialSchema for RawBytes {
    fn schema() -> RefOr<Schema> {
        binary().into()
    }
}

fn binary() -> ObjectBuilder {
    ObjectBuilder::new()
        .schema_type(Type::String)
        .format(Some(SchemaFormat::KnownFormat(KnownFormat::Binary)))
}

/// A form of the answer.
#[derive(ToSchema)]
#[schema(rename_all = "lowercase")]
#[expect(dead_code, reason = "describes what api::answer reads")]
enum FormatName {
    Json,
    Image,
    Coco,
    Cvat,
    Yolo,
    Voc,
    GeoJson,
}

/// A profile.
#[derive(ToSchema)]
#[schema(rename_all = "snake_case")]
#[expect(dead_code, reason = "describes what pipeline::DetectParameters reads")]
enum ProfileName {
    Paper,
    Fast,
    Balanced,
    Quality,
    Direct,
}

/// A refinement.
#[derive(ToSchema)]
#[schema(rename_all = "snake_case")]
#[expect(dead_code, reason = "describes what pipeline::DetectParameters reads")]
enum RefinementName {
    Nms,
    SoftNmsLinear,
    SoftNmsGaussian,
    Fusion,
}
