// The scripts are classic ones that share one global, `elusive`, so that a report can hold them in its one file.
import js from "@eslint/js";

const BROWSER = [
  "AbortController", "Blob", "CustomEvent", "DecompressionStream", "Image", "ImageData", "Path2D", "ResizeObserver",
  "Response", "TextDecoderStream", "atob", "clearTimeout", "cancelAnimationFrame", "devicePixelRatio", "document", "fetch", "getComputedStyle", "innerHeight",
  "matchMedia", "performance", "requestAnimationFrame", "setTimeout", "window",
];

export default [
  js.configs.recommended,
  {
    languageOptions: {
      ecmaVersion: 2023,
      sourceType: "script",
      globals: Object.fromEntries([...BROWSER, "elusive"].map((name) => [name, "readonly"])),
    },
    rules: { eqeqeq: "error", "no-var": "error", "prefer-const": "error", "no-unused-vars": "error" },
  },
  { files: ["**/workbench/drawing.js"], languageOptions: { sourceType: "module" } },
];
