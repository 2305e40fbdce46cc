% The text's section 9 in Octave: labels and scores of class probabilities, a montage, the cloud of the target's mask.
%
% octave target_cloud.m FOLDER TARGET
%   reads   image.png, depth.png (16 bits, millimetres), calibration.txt (9 numbers of K, 16 of T_base_cam, row by row),
%           probabilities.bin (float32, one image a class, each row by row)
%   writes  labels.png, scores.bin, montage.png, cloud.bin (float64 x y z, in the order of find: column by column)

arguments = argv();
folder = arguments{1};
target = str2double(arguments{2});
path = @(name) fullfile(folder, name);

rgb = imread(path("image.png"));
depth = double(imread(path("depth.png"))) * 0.001;  % metres: a PNG holds whole numbers only
[H, W] = size(depth);
numbers = load(path("calibration.txt"));
K = reshape(numbers(1:9), 3, 3).';
T_base_cam = reshape(numbers(10:25), 4, 4).';

% [C, scores] = semanticseg(rgb, net), from the probabilities that the network gave
file = fopen(path("probabilities.bin"), "r");
p = permute(reshape(fread(file, Inf, "float32=>single"), W, H, []), [2 1 3]);
fclose(file);
[scores, C] = max(p, [], 3);
C = uint8(C - 1);  % classes count from 0 in the kit, indices from 1 here
imwrite(C, path("labels.png"));
file = fopen(path("scores.bin"), "w");
fwrite(file, scores.', "float32");
fclose(file);

mask = C == target;
imwrite([rgb, repmat(uint8(255 * mask), [1 1 3])], path("montage.png"));  % imshowpair(rgb, mask, "montage")

[u, v] = meshgrid(0:W-1, 0:H-1);
idx = find(mask & depth > 0);  % the listing forgets that 0 is "no reading"
pix = [u(idx).'; v(idx).'; ones(1, numel(idx))];
P_cam = (K \ pix) .* depth(idx).';
P_base_h = T_base_cam * [P_cam; ones(1, columns(P_cam))];
file = fopen(path("cloud.bin"), "w");
fwrite(file, P_base_h(1:3, :), "float64");
fclose(file);
