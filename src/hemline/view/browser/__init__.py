"""What the page in the browser needs: server, controls, meshes, downloads, and checks of what a browser sends."""
