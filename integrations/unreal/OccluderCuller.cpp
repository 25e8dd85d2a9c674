#include "OccluderCuller.h"

#include "Camera/PlayerCameraManager.h"
#include "Engine/World.h"
#include "EngineUtils.h"
#include "GameFramework/PlayerController.h"
#include "Misc/FileHelper.h"
#include "Misc/Paths.h"

namespace
{
constexpr uint32 Rows = 180, Columns = 320;
constexpr double NearDepth = 0.1; // metres

// Unreal's exporter of GLB writes (x, y, z) as (x, z, y) / 100: metres, +y up, the other hand.
void ToFile(const FVector &From, double Scale, double To[3])
{
    To[0] = From.X * Scale;
    To[1] = From.Z * Scale;
    To[2] = From.Y * Scale;
}
} // namespace

AOccluderCuller::AOccluderCuller()
{
    PrimaryActorTick.bCanEverTick = true;
    PrimaryActorTick.TickGroup = TG_PostUpdateWork; // after the camera has moved
}

void AOccluderCuller::BeginPlay()
{
    Super::BeginPlay();
    const FString Path = FPaths::Combine(FPaths::ProjectContentDir(), File);
    occluder_tree_status Status = OCCLUDER_TREE_NOT_ONE;
    if (FFileHelper::LoadFileToArray(Bytes, *Path))
        Status = occluder_tree_open(Bytes.GetData(), static_cast<size_t>(Bytes.Num()), &Tree);
    if (Status != OCCLUDER_TREE_OK)
    {
        UE_LOG(LogTemp, Error, TEXT("%s: %s"), *Path, ANSI_TO_TCHAR(occluder_tree_text(Status)));
        SetActorTickEnabled(false);
        return;
    }
    Pixels.SetNumZeroed(static_cast<int32>(occluder_buffer_bytes(Rows, Columns, Tree.most_vertices)));
    Room.SetNumZeroed(static_cast<int32>(occluder_tree_room(&Tree)));
    Verdicts.SetNumZeroed(static_cast<int32>(Tree.part_count));
    occluder_buffer_init(&Buffer, Pixels.GetData(), Rows, Columns, Tree.most_vertices,
                         Tree.conservative ? OCCLUDER_INNER : OCCLUDER_CENTRE);
    FindActors();
}

void AOccluderCuller::FindActors()
{
    TMap<FString, AActor *> ByName;
    for (TActorIterator<AActor> Each(GetWorld()); Each; ++Each)
        if (!Each->ActorHasTag(TEXT("KeepShadow")))
            ByName.Add(Each->GetName(), *Each);
    Actors.SetNumZeroed(static_cast<int32>(Tree.object_count));
    int32 Missing = 0;
    for (uint32 Object = 0; Object < Tree.object_count; ++Object)
    {
        AActor **Found = ByName.Find(UTF8_TO_TCHAR(occluder_tree_name(&Tree, Object)));
        Actors[static_cast<int32>(Object)] = Found ? *Found : nullptr;
        Missing += Found ? 0 : 1;
    }
    if (Missing > 0)
        UE_LOG(LogTemp, Warning, TEXT("%d objects of the occluders are no actors here"), Missing);
}

bool AOccluderCuller::Look(occluder_view &View) const
{
    const APlayerController *Player = GetWorld()->GetFirstPlayerController();
    if (!Player || !Player->PlayerCameraManager)
        return false;
    const FRotationMatrix Turned(Player->PlayerCameraManager->GetCameraRotation());
    const double Half = FMath::DegreesToRadians(0.5 * Player->PlayerCameraManager->GetFOVAngle());
    const double Upright = FMath::RadiansToDegrees(2.0 * FMath::Atan(FMath::Tan(Half) * Rows / Columns));
    double Eye[3], Ahead[3], Up[3];
    ToFile(Player->PlayerCameraManager->GetCameraLocation(), 0.01, Eye);
    ToFile(Turned.GetUnitAxis(EAxis::X), 1.0, Ahead);
    ToFile(Turned.GetUnitAxis(EAxis::Z), 1.0, Up);
    View = occluder_look(Eye, Ahead, Up, Upright, NearDepth, Rows, Columns);
    return true;
}

void AOccluderCuller::Tick(float DeltaSeconds)
{
    Super::Tick(DeltaSeconds);
    occluder_view View;
    if (!Look(View))
        return;
    occluder_limits Limits = Tree.usual;
    if (MostTriangles > 0)
        Limits.most_triangles = static_cast<uint32>(MostTriangles);
    occluder_buffer_begin(&Buffer, &View);
    occluder_tree_cull_into(&Tree, &View, &Limits, &Buffer, Room.GetData(), Verdicts.GetData(), nullptr);
    for (uint32 Part = 0; Part < Tree.part_count;)
    {
        // Parts of an object follow each other; any that may be seen shows it.
        const uint32 Object = Tree.parts[Part].object;
        bool bSeen = false;
        for (; Part < Tree.part_count && Tree.parts[Part].object == Object; ++Part)
            bSeen |= Verdicts[static_cast<int32>(Part)] != OCCLUDER_HIDDEN;
        if (AActor *Actor = Actors[static_cast<int32>(Object)])
            Actor->SetActorHiddenInGame(!bSeen);
    }
}
