//! URIs of buffers and pictures: data within the JSON (RFC 2397), and files beside it (RFC 3986).

use crate::error::{Result, quoted};
use crate::scene::json::Node;
use crate::scene::json::files::Files;
use base64::Engine;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use percent_encoding::percent_decode_str;

/// Base64 as exporters write it: padded or not, whatever the last bits are.
const CONFIG: GeneralPurposeConfig =
    GeneralPurposeConfig::new().with_decode_padding_mode(DecodePaddingMode::Indifferent).with_decode_allow_trailing_bits(true);
const BASE64: GeneralPurpose = GeneralPurpose::new(&alphabet::STANDARD, CONFIG);

/// The bytes that `uri` stands for.
pub(in crate::scene) fn read(uri: &Node, files: &Files) -> Result<Vec<u8>> {
    let text = uri.string()?;
    match scheme(text) {
        Some("data") => decode_data(&text[5..]).ok_or_else(|| uri.fail("the data URI is not base64", "export the file again")),
        Some(other) => {
            let remedy = "download it, and name it by a path from the glTF file";
            Err(uri.fail(format!("{} is no file beside the glTF file, but a URI of scheme {other:?}", quoted(text)), remedy))
        }
        None => Ok(files.read_name(uri, &percent_decode_str(text).decode_utf8_lossy())?.1),
    }
}

/// The scheme of a URI that has one, in small letters (a single letter is a drive, of which Windows has such names).
fn scheme(uri: &str) -> Option<&'static str> {
    let (scheme, _) = uri.split_once(':')?;
    ["data", "http", "https", "ftp", "file", "blob"].into_iter().find(|known| scheme.eq_ignore_ascii_case(known))
}

/// The bytes of a data URI without its `data:`. Line breaks in it do not count.
fn decode_data(data: &str) -> Option<Vec<u8>> {
    let (head, text) = data.split_once(',')?;
    let is_base64 = head.trim_end().len() >= 7 && head.trim_end().to_ascii_lowercase().ends_with(";base64");
    if !is_base64 {
        return Some(percent_decode_str(text).collect());
    }
    if text.bytes().any(|b| b == b'%' || b.is_ascii_whitespace()) {
        let plain: Vec<u8> = percent_decode_str(text).filter(|b| !b.is_ascii_whitespace()).collect();
        return BASE64.decode(plain).ok();
    }
    BASE64.decode(text).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn data_is_decoded_in_all_its_spellings() {
        let spellings = [
            "application/octet-stream;base64,AQID/w==",
            ";base64,AQID/w",
            ";BASE64,AQID%2Fw%3D%3D",
            ";base64,AQ\nID /w==",
            ",%01%02%03%FF",
        ];
        for spelling in spellings {
            assert_eq!(decode_data(spelling), Some(vec![1, 2, 3, 255]), "{spelling}");
        }
        assert_eq!([decode_data(";base64,!!!"), decode_data("AQID")], [None, None]);
    }
}
