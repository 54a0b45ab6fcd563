//! Writing and reading in several formats of serde.

use serde::{Serialize, de::DeserializeOwned};

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Format {
    Json,
    Cbor,
    Bincode,
    Postcard,
}

/// Every format in turn.
pub const FORMATS: [Format; 4] = [
    Format::Json,
    Format::Cbor,
    Format::Bincode,
    Format::Postcard,
];

impl Format {
    pub fn write(self, value: &impl Serialize) -> Result<Vec<u8>, String> {
        match self {
            Format::Json => serde_json::to_vec(value).map_err(|e| e.to_string()),
            Format::Cbor => {
                let mut bytes = Vec::new();
                let written = ciborium::into_writer(value, &mut bytes);
                written.map(|()| bytes).map_err(|e| e.to_string())
            }
            Format::Bincode => bincode::serde::encode_to_vec(value, bincode::config::standard())
                .map_err(|e| e.to_string()),
            Format::Postcard => postcard::to_allocvec(value).map_err(|e| e.to_string()),
        }
    }

    pub fn read<T: DeserializeOwned>(self, bytes: &[u8]) -> Result<T, String> {
        match self {
            Format::Json => serde_json::from_slice(bytes).map_err(|e| e.to_string()),
            Format::Cbor => ciborium::from_reader(bytes).map_err(|e| e.to_string()),
            Format::Bincode => {
                // Without a limit, a length in damaged bytes allocates as much memory.
                let config = bincode::config::standard().with_limit::<{ 1 << 24 }>();
                bincode::serde::decode_from_slice(bytes, config)
                    .map(|(value, _)| value)
                    .map_err(|e| e.to_string())
            }
            Format::Postcard => postcard::from_bytes(bytes).map_err(|e| e.to_string()),
        }
    }
}
