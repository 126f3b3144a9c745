//! The description of the interface in the form of OpenAPI 3.1.

use axum::http::Method;
use serde_json::{Map, Value, json};

use crate::access::role::Authority;

/// A route as it is described.
#[derive(Debug, Clone)]
pub(crate) struct Operation {
    pub method: Method,
    pub path: &'static str,
    pub needs: Authority,
    /// What it does.
    pub what: &'static str,
}

/// The description of these operations.
pub(crate) fn description(operations: impl IntoIterator<Item = Operation>) -> Value {
    let mut paths = Map::new();
    for route in operations {
        // In axum `{*file}` is the rest of a path; OpenAPI has plain names only.
        let path = route.path.replace("{*", "{");
        let parameters: Vec<Value> = path
            .split('/')
            .filter_map(|part| part.strip_prefix('{')?.strip_suffix('}'))
            .map(|name| json!({"name": name, "in": "path", "required": true, "schema": {"type": "string"}}))
            .collect();
        let security = if route.needs == Authority::Public {
            json!([])
        } else {
            json!([{"token": []}, {"session": []}])
        };
        let operation = json!({
            "summary": route.what, "x-authority": route.needs, "parameters": parameters, "security": security,
            "responses": {
                "200": {"description": "Done"},
                "4XX": {"description": "Refused: {error, remedy}"},
            },
        });
        let at = paths.entry(path).or_insert_with(|| json!({}));
        at[route.method.as_str().to_lowercase()] = operation;
    }
    json!({
        "openapi": "3.1.0",
        "info": {"title": "fieldgap serve", "version": env!("CARGO_PKG_VERSION")},
        "paths": paths,
        "components": {"securitySchemes": {
            "token": {"type": "http", "scheme": "bearer"},
            "session": {"type": "apiKey", "in": "cookie", "name": "fieldgap_session"},
        }},
    })
}
