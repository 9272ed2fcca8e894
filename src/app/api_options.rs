//! The options of the API in the settings.

use std::sync::Arc;

use crate::{
    api::{Access, ApiOptions, Companions, RequestRate},
    reference_counts::ReferenceCounts,
    settings::Settings,
    telemetry::Tracer,
    views::Views,
};

/// Returns the options of the API.
pub(super) fn api_options(
    settings: &Settings,
    views: Arc<Views>,
    access: Access,
    companions: Companions,
    references: Arc<ReferenceCounts>,
    tracer: Tracer,
) -> ApiOptions {
    ApiOptions {
        max_body_bytes: settings.server.max_body_bytes,
        max_upload_bytes: settings.limits.max_upload_bytes,
        max_header_bytes: settings.connections.max_header_bytes,
        max_headers: settings.connections.max_headers,
        detect_defaults: settings.detect.clone(),
        zone_metrics: settings.calibrations.zone_metrics,
        camera_metrics: settings.results.camera_metrics,
        images_of: Arc::new(settings.results.images_of.clone()),
        image_age: settings.results.limits.max_age,
        conceal_images: settings.results.conceal_images,
        lens: settings.calibrations.lens,
        apply_suggested_calibrations: settings.calibrations.apply_suggested,
        metrics_elsewhere: settings.server.metrics_listen.is_some(),
        request_timeout: settings.server.request_timeout,
        min_upload_bytes_per_second: settings.limits.min_upload_bytes_per_second,
        request_rate: settings
            .limits
            .requests_per_second
            .map(|per_second| RequestRate {
                per_second,
                burst: settings.limits.request_burst,
            }),
        views,
        access,
        cors_origins: settings.access.cors_origins.clone(),
        hosts: settings.access.hosts.clone(),
        companions,
        references,
        tracer,
    }
}
