//! The calibrations of the cameras, as the server has them.

use std::{collections::BTreeMap, sync::Arc, time::Duration};

use lookdown_calibration::{Calibration, CalibrationFile};
use lookdown_common::{ServerClient, read_body, text::one_line};
use reqwest::{StatusCode, header::ETAG};

use crate::{
    definition::{CameraDefinition, DefinitionKey},
    store::{Store, StoredCalibrations},
};

/// Longest time for a calibration.
const TIMEOUT: Duration = Duration::from_secs(20);
/// Most calibrations that are kept, and most bytes of their files.
const MAX_CALIBRATIONS: usize = 1024;
const MAX_TOTAL_BYTES: usize = 16 << 20;

/// The calibrations by ID.
pub(crate) struct Calibrations {
    known: BTreeMap<String, Known>,
    /// Number of the last request.
    requests: u64,
}

/// A calibration, and the revision for which it was requested.
struct Known {
    /// The revision of the report that caused the request: the server may have a later one.
    requested: String,
    calibration: Option<Arc<Calibration>>,
    /// Bytes of its file.
    bytes: usize,
    /// Number of its request: the oldest is forgotten first.
    request: u64,
}

impl Calibrations {
    /// Continues with the calibrations of the store.
    pub(crate) fn resumed(stored: StoredCalibrations) -> Self {
        let known = stored.into_iter().map(|(id, (requested, content))| {
            let bytes = content.as_ref().map_or(0, Vec::len);
            let calibration = content.and_then(|content| parse(&id, &content).ok());
            let known = Known {
                requested,
                calibration: calibration.map(Arc::new),
                bytes,
                request: 0,
            };
            (id, known)
        });
        Self {
            known: known.collect(),
            requests: 0,
        }
    }

    /// Returns the definition of a key with what is known.
    pub(crate) fn definition(&self, key: DefinitionKey) -> Arc<CameraDefinition> {
        let known = key.calibration.as_ref().and_then(|id| self.known.get(id));
        let calibration = known.and_then(|known| known.calibration.as_ref());
        Arc::new(match calibration {
            Some(calibration) => CameraDefinition::new(key, calibration),
            None => CameraDefinition::without_calibration(key),
        })
    }

    /// Requests the calibration of a key unless its revision is known. An error is the problem of
    /// the server or of the store.
    pub(crate) async fn update(
        &mut self,
        client: &ServerClient,
        store: &Store,
        key: &DefinitionKey,
    ) -> Result<(), String> {
        let Some(id) = &key.calibration else {
            return Ok(());
        };
        let known = self.known.get(id);
        if known.is_some_and(|known| known.requested == key.revision) {
            return Ok(());
        }
        let content = request(client, id).await?;
        let parsed = content.as_ref().map(|content| parse(id, content));
        if let Some(Err(problem)) = &parsed {
            tracing::warn!("the calibration {id} of the server is not used: {problem}");
        }
        self.requests += 1;
        let known = Known {
            requested: key.revision.clone(),
            calibration: parsed.and_then(Result::ok).map(Arc::new),
            bytes: content.as_ref().map_or(0, Vec::len),
            request: self.requests,
        };
        self.known.insert(id.clone(), known);
        let forgotten = self.forget_oldest(id);
        let (store, id, revision) = (store.clone(), id.clone(), key.revision.clone());
        let stored = tokio::task::spawn_blocking(move || {
            store.put_calibration(&id, &revision, content.as_deref(), &forgotten)
        });
        // A task that panicked is logged by the panic hook.
        let stored = stored.await.unwrap_or(Ok(()));
        stored.map_err(|problem| problem.to_string())
    }

    /// Forgets the calibrations beyond the limits except one, and returns their IDs. Cameras that
    /// use them keep their definitions until the next start, which requests them again.
    fn forget_oldest(&mut self, except: &str) -> Vec<String> {
        let mut forgotten = Vec::new();
        let mut total: usize = self.known.values().map(|known| known.bytes).sum();
        while self.known.len() > MAX_CALIBRATIONS || total > MAX_TOTAL_BYTES {
            let others = self.known.iter().filter(|(id, _)| *id != except);
            let oldest = others.min_by_key(|(_, known)| known.request);
            let Some(id) = oldest.map(|(id, _)| id.clone()) else {
                break;
            };
            total -= self.known.remove(&id).map_or(0, |known| known.bytes);
            forgotten.push(id);
        }
        forgotten
    }
}

/// Requests a calibration in the native format; `None` if the server has none with this ID.
async fn request(client: &ServerClient, id: &str) -> Result<Option<Vec<u8>>, String> {
    let url = client.route(["calibrations", id]);
    let sent = client.send(client.get(url).timeout(TIMEOUT)).await;
    let response = sent.map_err(|error| client.failure(&error))?;
    match response.status() {
        StatusCode::OK => {
            let has_tag = response.headers().contains_key(ETAG);
            let body = read_body(response, CalibrationFile::MAX_BYTES).await;
            let body = body.map_err(|error| client.failure(&error))?;
            if has_tag {
                Ok(Some(body))
            } else {
                let address = client.address();
                Err(format!(
                    "{address} is not a Lookdown server: check upstream.url"
                ))
            }
        }
        StatusCode::NOT_FOUND => Ok(None),
        _ => Err(client.refusal(response).await),
    }
}

fn parse(id: &str, content: &[u8]) -> Result<Calibration, String> {
    let file = CalibrationFile::parse(content).map_err(|problem| one_line(&problem.to_string()))?;
    let first = file.calibrations(id, content).into_iter().next();
    let (_, calibration) = first.ok_or_else(|| "it has no camera".to_owned())?;
    calibration.map_err(|problem| one_line(&problem.to_string()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn calibrations_beyond_the_limits_are_forgotten() {
        let content = vec![b' '; CalibrationFile::MAX_BYTES];
        let stored =
            (0..40).map(|number| (number.to_string(), ("1".to_owned(), Some(content.clone()))));
        let mut calibrations = Calibrations::resumed(stored.collect());
        let forgotten = calibrations.forget_oldest("7");
        let kept = MAX_TOTAL_BYTES / CalibrationFile::MAX_BYTES;
        assert_eq!(calibrations.known.len(), kept);
        assert_eq!(forgotten.len(), 40 - kept);
        assert!(calibrations.known.contains_key("7"));
    }
}
