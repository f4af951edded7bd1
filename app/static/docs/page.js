// Swagger UI for docs/openapi.json, beside this file. All addresses are relative: they hold behind a proxy's path, too.

const LONGEST = 100; // characters of a line

/** JSON with short lists on one line, as people write positions. */
function compact(text) {
  return text.replace(/\[\s+([^[\]{}]*?)\s+\]/g, (list, inner) => {
    const line = `[${inner.replace(/\s*\n\s*/g, " ")}]`;
    return line.length > LONGEST ? list : line;
  });
}

function withCompactExamples({ React }) {
  const wrapped = (Original) => (props) => {
    const shown = typeof props.children === "string" ? compact(props.children) : props.children;
    return React.createElement(Original, { ...props, children: shown });
  };
  return { wrapComponents: { HighlightCode: wrapped } };
}

window.ui = SwaggerUIBundle({
  // whole: Swagger UI finds the pages of the operations from it and the relative server
  url: new URL("docs/openapi.json", location.href).href,
  dom_id: "#swagger-ui",
  presets: [SwaggerUIBundle.presets.apis, SwaggerUIBundle.SwaggerUIStandalonePreset],
  plugins: [withCompactExamples],
  layout: "BaseLayout",
  deepLinking: true,
  displayRequestDuration: true,
  filter: true,
  syntaxHighlight: false, // to colour an answer of a megabyte takes seconds
  validatorUrl: null, // it would fetch a badge from another site
});
