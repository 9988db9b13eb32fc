// Makes page.html, the one file of the viewer, of what lies in page/.
// node build.mjs MODULES OUTPUT: MODULES is a folder node_modules as package-lock.json has it.
import { readFileSync, writeFileSync } from "node:fs";
import { createRequire } from "node:module";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const [modules, output] = process.argv.slice(2);
if (!output) {
    console.error("node build.mjs MODULES OUTPUT");
    process.exit(2);
}
const here = dirname(fileURLToPath(import.meta.url));
const { build } = createRequire(resolve(modules, "_"))("esbuild");

/** The text of a bundle that begins with this file. */
async function bundled(file) {
    const result = await build({
        entryPoints: [join(here, "page", file)],
        absWorkingDir: here,
        bundle: true,
        minify: true,
        write: false,
        format: "iife",
        target: ["chrome103", "firefox113", "safari16.4"],
        legalComments: "inline",
        nodePaths: [resolve(modules)],
    });
    return result.outputFiles[0].text;
}

const script = (await bundled("main.js")).replaceAll("</script", "<\\/script");
const style = await bundled("style.css");
const licence = readFileSync(resolve(modules, "three", "LICENSE"), "utf8").trim();
const parts = {
    "/* style.css */": style,
    "/* main.js */": `/* with three.js:\n${licence}\n*/\n${script}`,
};
let page = readFileSync(join(here, "page", "index.html"), "utf8");
for (const [mark, part] of Object.entries(parts)) {
    page = page.replace(mark, () => part);
}
writeFileSync(output, page);
