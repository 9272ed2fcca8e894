//! From the URL of a bucket to its provider's client, with bounds on every request.

use std::{sync::Arc, time::Duration};

use object_store::{
    BackoffConfig, ClientConfigKey, ObjectStore, ObjectStoreScheme, RetryConfig,
    aws::{AmazonS3Builder, AmazonS3ConfigKey},
    azure::{AzureConfigKey, MicrosoftAzureBuilder},
    gcp::{GoogleCloudStorageBuilder, GoogleConfigKey},
    list::PaginatedListStore,
    path::Path,
};
use url::Url;

use super::bounded::BoundedConnector;

/// Bounds of a request, whatever the provider's variables say.
const BOUNDS: [(ClientConfigKey, &str); 2] = [
    (ClientConfigKey::ConnectTimeout, "3 seconds"),
    (ClientConfigKey::Timeout, "5 seconds"),
];
/// Requests that fail for a reason that may pass are sent this many times more ...
const RETRIES: usize = 2;
/// ... unless the first was sent longer ago than this.
const RETRY_FOR: Duration = Duration::from_secs(5);
/// Longest pause before a request is sent again.
const MAX_PAUSE: Duration = Duration::from_secs(1);

/// The options of a provider's client.
pub(super) trait Objects: ObjectStore + PaginatedListStore {}
impl<T: ObjectStore + PaginatedListStore> Objects for T {}

/// A provider's client, as its variables say.
macro_rules! client {
    ($builder:ty, $client_key:path, $prefix:literal, $url:expr, $variables:expr) => {{
        let builder = <$builder>::new().with_url($url.as_str());
        let builder = $variables
            .filter(|(name, _)| name.starts_with($prefix))
            .fold(builder, |builder, (name, value)| {
                match name.to_ascii_lowercase().parse() {
                    Ok(key) => builder.with_config(key, value),
                    // Meant for other programs.
                    Err(_) => builder,
                }
            });
        let bounded = BOUNDS.iter().fold(builder, |builder, (key, value)| {
            builder.with_config($client_key(*key), *value)
        });
        let client = bounded
            .with_retry(retries())
            .with_http_connector(BoundedConnector::default())
            .build();
        client.map(|client| Arc::new(client) as Arc<dyn Objects>)
    }};
}

/// The client for the bucket of `url`, and the level in it. Sends nothing.
///
/// # Errors
/// One sentence, without secrets.
pub(super) fn to(
    url: &Url,
    variables: impl Iterator<Item = (String, String)>,
) -> Result<(Arc<dyn Objects>, Path), String> {
    // Fails when there is one already, which is as good.
    let _ = rustls::crypto::ring::default_provider().install_default();
    let (scheme, level) = ObjectStoreScheme::parse(url).map_err(|_| unknown(url))?;
    let client = match scheme {
        ObjectStoreScheme::AmazonS3 => {
            client!(
                AmazonS3Builder,
                AmazonS3ConfigKey::Client,
                "AWS_",
                url,
                variables
            )
        }
        ObjectStoreScheme::GoogleCloudStorage => {
            client!(
                GoogleCloudStorageBuilder,
                GoogleConfigKey::Client,
                "GOOGLE_",
                url,
                variables
            )
        }
        ObjectStoreScheme::MicrosoftAzure => {
            client!(
                MicrosoftAzureBuilder,
                AzureConfigKey::Client,
                "AZURE_",
                url,
                variables
            )
        }
        _ => return Err(unknown(url)),
    };
    let client = client.map_err(|error| format!("its settings cannot be used: {error}"))?;
    Ok((client, level))
}

fn unknown(url: &Url) -> String {
    let scheme = url.scheme();
    format!(
        "{scheme}:// is not a bucket's address: give s3://BUCKET/PREFIX, gs://BUCKET/PREFIX, \
         az://CONTAINER/PREFIX, the https:// address of a bucket of these providers, or a folder"
    )
}

fn retries() -> RetryConfig {
    RetryConfig {
        max_retries: RETRIES,
        retry_timeout: RETRY_FOR,
        backoff: BackoffConfig {
            max_backoff: MAX_PAUSE,
            ..BackoffConfig::default()
        },
    }
}
