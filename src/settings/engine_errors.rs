//! Errors of the engine in the words of the settings.

use lookdown_detect::inference::InferenceError;

/// Returns the text of an error of the engine, with the setting that it depends on and the remedy.
pub fn explain(error: &InferenceError) -> String {
    match error {
        InferenceError::Runtime { .. } => {
            format!("inference.library_path: {error}, which `make setup` fetches")
        }
        InferenceError::NoProvider { .. } => {
            format!("inference.device and inference.library_path: {error}")
        }
        InferenceError::NoDevice { .. } => format!("inference.device: {error}"),
        InferenceError::Unreadable { .. } => format!(
            "{error}; the repository has the default models, and `make models` fetches others"
        ),
        InferenceError::NoManifest { network, .. } => format!(
            "{error}: write it with `lookdown model check --write-manifest {}`",
            network.display()
        ),
        InferenceError::Remote { .. } | InferenceError::RemoteModel { .. } => {
            format!("inference.url: {error}")
        }
        InferenceError::RemoteDenied { .. } => format!("inference.bearer_token: {error}"),
        InferenceError::Unusable { .. }
        | InferenceError::RemoteBusy { .. }
        | InferenceError::Run(_) => error.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use lookdown_detect::inference::{Device, OpenVinoDevice};

    use super::*;

    #[test]
    fn an_error_of_the_engine_names_the_setting_and_the_remedy() {
        let (path, url) = (|| "/here".into(), || "http://here".to_owned());
        let detail = || "some reason".to_owned();
        for (error, parts) in [
            (
                InferenceError::Runtime {
                    path: path(),
                    detail: detail(),
                },
                [
                    "inference.library_path: ",
                    "/here: some reason; ",
                    "`make setup`",
                ],
            ),
            (
                InferenceError::NoProvider {
                    device: Device::Cuda(0),
                    path: path(),
                },
                [
                    "inference.device",
                    "inference.library_path: cuda:0 ",
                    "onnxruntime-gpu",
                ],
            ),
            (
                InferenceError::NoProvider {
                    device: Device::OpenVino(OpenVinoDevice::Gpu),
                    path: path(),
                },
                [
                    "inference.device",
                    "inference.library_path: openvino:gpu ",
                    "onnxruntime-openvino",
                ],
            ),
            (
                InferenceError::NoDevice {
                    device: Device::Cuda(1),
                    detail: detail(),
                },
                ["inference.device: cuda:1 ", "some reason", "use cpu"],
            ),
            (
                InferenceError::Unreadable {
                    path: path(),
                    detail: detail(),
                },
                ["model: /here ", "some reason; ", "`make models`"],
            ),
            (
                InferenceError::NoManifest {
                    path: path(),
                    network: "/own/network.onnx".into(),
                },
                [
                    "model: /here ",
                    "/own/network.onnx: write it ",
                    "`lookdown model check --write-manifest /own/network.onnx`",
                ],
            ),
            (
                InferenceError::Remote {
                    url: url(),
                    detail: detail(),
                },
                ["inference.url: ", "http://here", "some reason"],
            ),
            (
                InferenceError::RemoteModel {
                    model: "m".to_owned(),
                    problem: detail(),
                },
                ["inference.url: ", "model m", "some reason"],
            ),
            (
                InferenceError::RemoteDenied {
                    url: url(),
                    detail: detail(),
                },
                ["inference.bearer_token: ", "http://here", "use the token"],
            ),
        ] {
            let text = explain(&error);
            for part in parts {
                assert!(text.contains(part), "{text}: {part}");
            }
        }
    }
}
