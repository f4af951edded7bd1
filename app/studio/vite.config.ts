// Builds the page into `app/static/studio`, whose files the service sends.
import { readFileSync } from "node:fs";
import { defineConfig, type Plugin } from "vite";

const BUNDLED = ["@fontsource-variable/inter", "@preact/signals", "preact", "three", "uplot"];

/** The licences of what is in the bundle, as one file beside it. */
function licences(): Plugin {
  return {
    name: "licences",
    generateBundle() {
      const texts = BUNDLED.map((name) => {
        const text = readFileSync(
          new URL(`node_modules/${name}/LICENSE`, import.meta.url),
          "utf-8",
        );
        return `${name}\n\n${text.trim()}\n`;
      });
      this.emitFile({ type: "asset", fileName: "licences.txt", source: texts.join("\n\n") });
    },
  };
}

export default defineConfig({
  plugins: [licences()],
  build: {
    outDir: "../static/studio",
    emptyOutDir: true,
    target: "es2022",
    modulePreload: false,
    assetsInlineLimit: 0,
    cssCodeSplit: false,
    chunkSizeWarningLimit: 1000,
    rollupOptions: {
      output: {
        entryFileNames: "main.js",
        chunkFileNames: "[name].js",
        assetFileNames: "[name][extname]",
      },
    },
  },
  // The page is at `/studio`, its files below `/studio/`; behind a proxy under any path.
  experimental: {
    renderBuiltUrl: (name, { hostType }) =>
      hostType === "html" ? `studio/${name}` : { relative: true },
  },
});
