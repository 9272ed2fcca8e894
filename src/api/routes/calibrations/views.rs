//! The view plan of a calibration.

use std::sync::Arc;

use axum::{
    extract::State,
    http::{Uri, header::CONTENT_TYPE},
    response::{IntoResponse, Response},
};
use lookdown_calibration::Calibration;
use lookdown_detect::{
    parameters::{Profile, parse_profile, whole_number},
    pipeline::{Engine, PlannedView},
};
use lookdown_lens::geometry::{Lens, Pixel};
use serde::Serialize;
use utoipa::{IntoParams, ToSchema};

use super::{
    unknown,
    upload::{CalibrationAddress, CalibrationTrial, CalibrationUpload, NewCalibrationAddress},
};
use crate::{
    api::{
        ApiState,
        http::{access::Caller, deadline::Deadline, problem::Problem, query::parameters_named},
        openapi::RawBytes,
        require_scope::RequireRead,
    },
    calibration_store::Calibrations,
    rounding::pixels,
};

/// Largest number of cells along each side of a grid.
const MAX_GRID_CELLS: u32 = 32;

/// The view plan of a calibration.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct ViewPlanInfo {
    /// The ID of the calibration.
    calibration: String,
    /// The revision of the calibration, as in reports.
    revision: String,
    /// The profile.
    #[schema(example = "balanced")]
    profile: &'static str,
    /// The model that the views are made for.
    model: String,
    /// Width and height of the frames in whose pixels the outlines are given.
    image: [u32; 2],
    /// Fraction of the lens image that at least one view covers, 0 to 1.
    #[schema(example = 0.998)]
    coverage: f64,
    /// Mean number of views that cover a point of the lens image.
    #[schema(example = 3.1)]
    overlap: f64,
    /// The cost of a frame.
    cost: PlanCost,
    /// The views, in the order in which the model receives them; empty for `direct`.
    views: Vec<ViewInfo>,
}

/// The cost of a frame.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct PlanCost {
    /// Largest number of images that the model receives for the views of a frame: narrow views are
    /// left out where the wide ones show no possible person.
    images: usize,
    /// Largest number of additional upright crops of the frame.
    crops_at_most: usize,
    /// Largest number of batches for these images.
    batches: usize,
    /// Number of pixels of these images.
    pixels: u64,
}

/// A virtual view.
#[derive(Serialize, ToSchema)]
pub(in crate::api) struct ViewInfo {
    /// Rotation from the view frame to the camera frame, row by row (x right, y down, z along the
    /// axis in both).
    camera_from_view: [[f64; 3]; 3],
    /// Azimuth of the axis, clockwise from image right, degrees.
    azimuth_deg: f64,
    /// Angle between the axis and the optical axis, degrees.
    off_axis_deg: f64,
    /// Horizontal field of view, degrees.
    field_of_view_deg: f64,
    /// Width and height, pixels.
    size: [u32; 2],
    /// Focal length, pixels.
    focal: f64,
    /// Principal point, in pixels with integer coordinates at pixel centers.
    principal_point: [f64; 2],
    /// Border of the view in the frame, clockwise from its top left corner, corner-origin pixels.
    /// Points beyond the lens image are moved to its rim.
    outline: Vec<[f64; 2]>,
    /// Positions in the frame of the nodes of a grid over the view, row by row from its top left
    /// corner, corner-origin pixels; null beyond the lens image. The grid suffices to undistort a
    /// frame without the lens model. Absent unless requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    grid: Option<Vec<Option<[f64; 2]>>>,
}

/// The query parameters of a view plan.
#[derive(IntoParams)]
#[into_params(parameter_in = Query)]
#[expect(dead_code, reason = "documents the query that ViewPlanRequest parses")]
struct ViewPlanQuery {
    /// The profile; `balanced` by default.
    profile: Option<String>,
    /// Adds a grid with this number of cells along each side of a view.
    #[param(minimum = 1, maximum = 32)]
    grid: Option<u32>,
}

/// Get the view plan
///
/// Returns the pose, the intrinsics and the outline of each view, the coverage of the lens image,
/// and the cost of a frame.
#[utoipa::path(
    get, path = "/calibrations/{id}/views", tag = "calibrations", operation_id = "get_views",
    params(
        ("id" = String, Path, pattern = "^[a-z0-9][a-z0-9_-]{0,63}$", description = "The calibration's ID."),
        ViewPlanQuery,
    ),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses((status = OK, description = "The view plan.", body = ViewPlanInfo))
)]
pub(in crate::api) async fn get_views(
    State(state): State<ApiState>,
    _reader: RequireRead,
    deadline: Deadline,
    caller: Caller,
    CalibrationAddress(id): CalibrationAddress,
    uri: Uri,
) -> Result<Response, Problem> {
    let [profile, grid] = parameters_named(&uri, ["profile", "grid"])?;
    let request = ViewPlanRequest::parse(profile.as_deref(), grid.as_deref())?;
    let calibrations = &state.calibrations;
    let entry = calibrations
        .entry(&id)
        .ok_or_else(|| unknown(&state, &id))?;
    let plan = move |engine: &Engine| request.plan(engine, &entry.calibration);
    answered(&state, deadline, &caller, plan).await
}

/// Preview a view plan
///
/// Accepts the same body and parameters as `PUT /calibrations/{id}` and returns the view plan.
/// Nothing is stored.
#[utoipa::path(
    post, path = "/calibrations/{id}/views", tag = "calibrations", operation_id = "try_views",
    params(
        ("id" = String, Path, pattern = "^[a-z0-9][a-z0-9_-]{0,63}$", description = "The calibration's ID."),
        ViewPlanQuery,
        ("camera" = Option<String>, Query, description = "The name of the camera in the file."),
        ("size" = Option<String>, Query, description = "The size of the camera's frames in pixels, such as \
            `1280x960`, for formats that do not state it.", pattern = "^[0-9]+x[0-9]+$"),
    ),
    request_body(
        description = "A calibration file of at most 1 MiB. Its content decides the format, not the content type.",
        content((Object = "application/json"), (inline(RawBytes) = "application/octet-stream")),
    ),
    security((), ("bearer" = ["read"]), ("api_key" = ["read"])),
    responses((status = OK, description = "The view plan.", body = ViewPlanInfo))
)]
pub(in crate::api) async fn try_views(
    State(state): State<ApiState>,
    _reader: RequireRead,
    deadline: Deadline,
    caller: Caller,
    NewCalibrationAddress(id): NewCalibrationAddress,
    trial: CalibrationTrial,
) -> Result<Response, Problem> {
    let request = ViewPlanRequest::parse(trial.profile.as_deref(), trial.grid.as_deref())?;
    let CalibrationUpload { content, reading } = trial.upload;
    let plan = move |engine: &Engine| {
        let entry = Calibrations::check(&id, &content, &reading)?;
        request.plan(engine, &entry.calibration)
    };
    answered(&state, deadline, &caller, plan).await
}

/// Returns a view plan as JSON. A plan may have megabytes, so it is built and serialized under a
/// permit of the frame queue.
async fn answered(
    state: &ApiState,
    deadline: Deadline,
    caller: &Caller,
    plan: impl FnOnce(&Engine) -> Result<ViewPlanInfo, Problem> + Send + 'static,
) -> Result<Response, Problem> {
    let workers = Arc::clone(&state.workers);
    let planning = state.workers.run(caller.ticket(), move |_| {
        let plan = plan(workers.engine())?;
        serde_json::to_vec(&plan).map_err(Problem::internal)
    });
    let json = deadline
        .wait(
            "the view plan was not finished",
            "send fewer requests",
            planning,
        )
        .await??;
    Ok(([(CONTENT_TYPE, "application/json")], json).into_response())
}

/// The parsed query of a view plan.
#[derive(Clone, Copy)]
struct ViewPlanRequest {
    profile: Profile,
    grid_cells: Option<u32>,
}

impl ViewPlanRequest {
    fn parse(profile: Option<&str>, grid: Option<&str>) -> Result<Self, Problem> {
        let profile = profile.map(parse_profile).transpose()?;
        let cells = |text| whole_number("grid", text, 1..=MAX_GRID_CELLS);
        let grid_cells = grid.map(cells).transpose()?;
        Ok(Self {
            profile: profile.unwrap_or_default(),
            grid_cells,
        })
    }

    fn plan(self, engine: &Engine, calibration: &Calibration) -> Result<ViewPlanInfo, Problem> {
        let planned = engine.planned_views(calibration, self.profile)?;
        let views = planned.views.iter();
        let views = views.map(|view| self.view(view, calibration.lens()));
        Ok(ViewPlanInfo {
            calibration: calibration.id().to_string(),
            revision: calibration.revision().to_owned(),
            profile: planned.profile.name(),
            image: [planned.image_width, planned.image_height],
            coverage: planned.seen_share,
            overlap: planned.mean_views,
            cost: PlanCost {
                images: planned.images,
                crops_at_most: planned.crops_at_most,
                batches: planned.batches,
                pixels: planned.pixels,
            },
            views: views.collect(),
            model: planned.model,
        })
    }

    fn view(self, planned: &PlannedView, lens: &Lens) -> ViewInfo {
        let view = &planned.view;
        let rotation = view.camera_from_view.matrix();
        let axis = rotation.column(2);
        let principal = view.principal_point();
        let node = |node: Option<Pixel>| node.map(|at| [pixels(at.x), pixels(at.y)]);
        let grid = self.grid_cells.map(|cells| planned.grid(lens, cells));
        ViewInfo {
            camera_from_view: [0, 1, 2].map(|row| [0, 1, 2].map(|column| rotation[(row, column)])),
            azimuth_deg: axis.y.atan2(axis.x).to_degrees().rem_euclid(360.0),
            off_axis_deg: axis.x.hypot(axis.y).atan2(axis.z).to_degrees(),
            field_of_view_deg: view.field_of_view().to_degrees(),
            size: [view.width, view.height],
            focal: view.focal,
            principal_point: [principal.x, principal.y],
            outline: planned.outline.iter().map(|at| [at.x, at.y]).collect(),
            grid: grid.map(|nodes| nodes.into_iter().map(node).collect()),
        }
    }
}
