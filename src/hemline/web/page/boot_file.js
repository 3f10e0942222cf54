// A page in one file, with data, kernels and modules, zipped, in base64.
const showStatus = (text) => (document.getElementById("loading").textContent = text);

async function unzip(id) {
  const text = atob(document.getElementById(id).textContent), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) bytes[i] = text.charCodeAt(i);
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function begin() {
  const modules = JSON.parse(new TextDecoder().decode(await unzip("modules"))), imports = {};
  for (const [name, source] of Object.entries(modules)) {
    imports[name] = URL.createObjectURL(new Blob([source], { type: "text/javascript" }));
  }
  const map = document.createElement("script");
  map.type = "importmap";
  map.textContent = JSON.stringify({ imports });
  document.head.append(map);
  const { open } = await import("hemline/main.js");
  await open(await unzip("contents"), await unzip("kernels"));
}

begin().catch((error) => showStatus(`This page needs a browser of 2023 or later (${error.message}).`));
